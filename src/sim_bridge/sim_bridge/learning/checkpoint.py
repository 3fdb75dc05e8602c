# SPDX-License-Identifier: Apache-2.0
"""Files of a training run: a checkpoint while it lasts, then its policy, history and result."""

import json
import pickle
import platform
import subprocess
import time
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.policy_file import PolicyContract, save_policy
from sim_bridge.learning.export import network_of
from sim_bridge.learning.run import Run
from sim_bridge.learning.session import Session

CHECKPOINT = "checkpoint.pickle"
HISTORY = "history.json"
POLICY = "policy.pt"
RESULT = "result.json"
# So much of a run is lost at most.
SAVE_EVERY_S = 30.0


class RunFolder:
    """Output folder of one run."""

    def __init__(self, path: Path, run: Run) -> None:
        self.path = path
        self._run = run
        self._saved_at_s = time.monotonic()

    @property
    def finished(self) -> bool:
        """Whether the run has ended and its policy is here.

        Raises:
            ConfigurationError: what lies here is of another run.
        """
        result = self.path / RESULT
        if not result.is_file():
            return False
        self._require_same(json.loads(result.read_text(encoding="utf-8"))["run"])
        return True

    def save(self, session: Session, every_s: float = 0.0) -> None:
        """Write a checkpoint, unless the last one is younger than `every_s`.

        The former one is replaced only once the new one is complete.
        """
        if time.monotonic() - self._saved_at_s < every_s:
            return
        self.path.mkdir(parents=True, exist_ok=True)
        partial = self.path / (CHECKPOINT + ".partial")
        with partial.open("wb") as file:
            content = {"run": self._run.description(), "session": session.state_dict()}
            pickle.dump(content, file, protocol=pickle.HIGHEST_PROTOCOL)
        partial.replace(self.path / CHECKPOINT)
        self._write_json(HISTORY, [asdict(record) for record in session.records])
        self._saved_at_s = time.monotonic()

    def resume(self, session: Session) -> bool:
        """Take over the checkpoint if there is one; return whether there was.

        Raises:
            ConfigurationError: the checkpoint is damaged or of another run.
        """
        path = self.path / CHECKPOINT
        if not path.is_file():
            return False
        try:
            with path.open("rb") as file:
                content: dict[str, Any] = pickle.load(file)  # noqa: S301 (the user's own file)
        except (pickle.UnpicklingError, EOFError, AttributeError, ImportError) as error:
            raise ConfigurationError(
                f"{path} cannot be read ({error}), delete it to begin anew"
            ) from error
        self._require_same(content["run"])
        session.load_state_dict(content["session"])
        return True

    def finish(self, session: Session, name: str) -> Path:
        """Write the best policy and the result, and drop the checkpoint; return the policy."""
        best = session.best
        if best is None:
            raise ConfigurationError("a run that was never validated has no policy to write")
        self.path.mkdir(parents=True, exist_ok=True)
        outcome = {
            "run": self._run.description(),
            "best_steps": best.steps,
            "validation": asdict(best.score),
        }
        contract = PolicyContract(
            name=name,
            state=session.state_config,
            decision_period_s=session.decision_period_s,
            maps=tuple(Path(name).stem for name in self._run.map_names),
            training={**outcome, "versions": versions()},
            git_revision=git_revision(),
            outlook=session.outlook_config if self._run.config.outlook else None,
        )
        policy = self.path / POLICY
        sha256 = save_policy(policy, network_of(best.weights), contract)
        self._write_json(HISTORY, [asdict(record) for record in session.records])
        self._write_json(RESULT, {**outcome, "name": name, "sha256": sha256})
        (self.path / CHECKPOINT).unlink(missing_ok=True)
        return policy

    def _require_same(self, found: dict[str, Any]) -> None:
        expected = self._run.description()
        if found == expected:
            return
        before, now, missing = _flat(found), _flat(expected), object()
        changed = "; ".join(
            f"{name} was {before.get(name)}, now {now.get(name)}"
            for name in sorted(before.keys() | now.keys())
            if before.get(name, missing) != now.get(name, missing)
        )
        raise ConfigurationError(
            f"{self.path} holds another training run: {changed}; "
            "choose another output folder or delete this one"
        )

    def _write_json(self, name: str, content: object) -> None:
        (self.path / name).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def _flat(content: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return nested dictionaries as one, with names such as config.steps."""
    found: dict[str, Any] = {}
    for name, value in content.items():
        if isinstance(value, dict):
            found |= _flat(value, f"{prefix}{name}.")
        else:
            found[prefix + name] = value
    return found


def versions() -> dict[str, str]:
    """Return the versions of what computes a policy."""
    packages = {name: version(name) for name in ("numpy", "numba", "torch")}
    return {"python": platform.python_version(), **packages}


def git_revision() -> str:
    """Return the revision of the sources, with -dirty where they differ from it, or "unknown"."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        found = subprocess.run(  # noqa: S603 (fixed words)
            command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return found.stdout.strip()
