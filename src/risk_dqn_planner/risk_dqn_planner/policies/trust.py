# SPDX-License-Identifier: Apache-2.0
"""Which policy files may be loaded: reading TorchScript runs its code.

Files that come with the planner are listed with their hashes. Further ones are trusted by hash, or
by a list of hashes such as `sha256sum` writes. A person who names a file to a command, or to a
function, has said so; a node is given its file by others, and asks.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

from risk_dqn_planner.errors import PolicyFileError
from risk_dqn_planner.policies.shipped import SUMS, shipped_policies

_HASH = re.compile(r"[0-9a-fA-F]{64}")


@dataclass(frozen=True)
class Trust:
    """Hashes of the files that may be loaded, or whether any may."""

    hashes: frozenset[str] = field(default_factory=frozenset)
    anything: bool = False

    def check(self, path: Path | str, sha256: str) -> None:
        """Raise PolicyFileError unless the file of this hash may be loaded."""
        if self.anything or sha256 in self.hashes:
            return
        raise PolicyFileError(
            f"policy file {path} has SHA-256 {sha256}, which no list of trusted files holds; "
            "loading a TorchScript file runs its code. Whoever trusts it names that hash in "
            "trusted_policies, or sets allow_unlisted_policy"
        )


ANYTHING = Trust(anything=True)


def listed(further: str = "") -> Trust:
    """Return the trust in the planner's own files and in further ones.

    further: hashes, and paths of lists of hashes, separated by blanks or commas.

    Raises:
        PolicyFileError: a list cannot be read, or a line of it has no hash.
    """
    hashes = {policy.sha256 for policy in shipped_policies().values()}
    for word in further.replace(",", " ").split():
        if _HASH.fullmatch(word):
            hashes.add(word.lower())
        else:
            hashes.update(_read_list(Path(word)))
    return Trust(frozenset(hashes))


def _read_list(path: Path) -> list[str]:
    try:
        lines = path.read_text("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise PolicyFileError(
            f"trusted_policies names {path}, which is neither a SHA-256 nor a list of them "
            f"such as {SUMS} that can be read: {error}"
        ) from error
    found = []
    for line in filter(str.strip, lines):
        first = line.split(maxsplit=1)[0]
        if not _HASH.fullmatch(first):
            raise PolicyFileError(f"{path}: '{line}' does not begin with a SHA-256")
        found.append(first.lower())
    return found
