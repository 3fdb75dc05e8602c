# SPDX-License-Identifier: Apache-2.0
"""The trained policies that come with the planner: where their files lie, and what they must be.

Each has a file and a model card of its name; SHA256SUMS lists the files' hashes, one a line, as
`sha256sum` writes and checks them.
"""

from dataclasses import dataclass
from pathlib import Path

from risk_dqn_planner.errors import PolicyFileError

FOLDER = "models"
SUMS = "SHA256SUMS"
PACKAGE = "risk_dqn_planner"
# What decides where nobody says which policy shall, and what its supervisor does. A policy that is
# not sound by itself is made so unless the user says otherwise.
DEFAULT_POLICY = "sound_dqn"
DEFAULT_SUPERVISOR = "enforce"


@dataclass(frozen=True)
class ShippedPolicy:
    """A policy file with its listed SHA-256."""

    name: str
    path: Path
    sha256: str

    @property
    def card(self) -> Path:
        """The model card: what it was trained on, what it achieves, what it cannot."""
        return self.path.with_suffix(".md")


def models_folder() -> Path:
    """Return the models' folder: beside the package in the sources, under share/ if installed.

    Raises:
        PolicyFileError: the folder is in neither place.
    """
    for parent in Path(__file__).resolve().parents:
        for folder in (parent / FOLDER, parent / "share" / PACKAGE / FOLDER):
            if (folder / SUMS).is_file():
                return folder
    raise PolicyFileError(
        f"the project's trained policies are not installed: no {FOLDER}/{SUMS} near {__file__}"
    )


def shipped_policies(folder: Path | None = None) -> dict[str, ShippedPolicy]:
    """Return all trained policies by their names, as listed in SHA256SUMS.

    folder: by default `models_folder`.

    Raises:
        PolicyFileError: there is no list, or a line of it is none.
    """
    sums = (folder or models_folder()) / SUMS
    found = {}
    for line in sums.read_text(encoding="utf-8").splitlines():
        sha256, _, file = line.partition("  ")
        if len(sha256) != 64 or not file.endswith(".pt"):
            raise PolicyFileError(f"{sums}: '{line}' is not a SHA-256, two blanks and a .pt file")
        path = sums.parent / file
        found[path.stem] = ShippedPolicy(path.stem, path, sha256)
    return found


def write_sums(policies: dict[str, ShippedPolicy], folder: Path) -> None:
    """Write the list anew, in the order of the names."""
    lines = [f"{policies[name].sha256}  {policies[name].path.name}\n" for name in sorted(policies)]
    (folder / SUMS).write_text("".join(lines), encoding="utf-8")
