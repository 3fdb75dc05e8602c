# SPDX-License-Identifier: Apache-2.0
"""Finished training runs on disk, and which of them are further seeds of a shipped policy."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from risk_dqn_planner.policies.fingerprint import fingerprint
from risk_dqn_planner.policies.shipped import ShippedPolicy
from sim_bridge.learning.checkpoint import HISTORY, POLICY, RESULT

# Where runs are looked for: one's own, then those that published results rest on.
RUN_FOLDERS = (Path("out/training"), Path("src/sim_bridge/trained"))


@dataclass(frozen=True)
class Training:
    """What a policy was trained on, and with which seed.

    description: fingerprint of everything but the seed.
    """

    description: str
    seed: int

    @classmethod
    def of(cls, training: object) -> "Training | None":
        """Read it from `training` of a policy's contract, or a result.json; None if not there."""
        run = training.get("run") if isinstance(training, Mapping) else None
        if not isinstance(run, Mapping) or not isinstance(run.get("seed"), int):
            return None
        rest = {key: value for key, value in run.items() if key != "seed"}
        return cls(fingerprint(rest), run["seed"])


@dataclass(frozen=True)
class TrainingRun:
    """A finished run: its policy file, the name it was given, and how it was trained."""

    folder: Path
    name: str
    training: Training

    @property
    def policy(self) -> Path:
        """The policy file."""
        return self.folder / POLICY

    def history(self) -> list[dict[str, Any]]:
        """Return the records of its evaluations while it was trained; empty without any."""
        try:
            records = json.loads((self.folder / HISTORY).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return []
        return list(records)


def training_runs(folders: Iterable[Path]) -> list[TrainingRun]:
    """Return the finished runs in some folders; of runs that are the same but once, the first.

    What cannot be read is no finished run.
    """
    found: dict[tuple[str, Training], TrainingRun] = {}
    for folder in folders:
        for result in sorted(folder.glob(f"*/{RESULT}")):
            run = _run(result)
            if run is not None:
                found.setdefault((run.name, run.training), run)
    return list(found.values())


def _run(result: Path) -> TrainingRun | None:
    try:
        content = json.loads(result.read_text(encoding="utf-8"))
        training, name = Training.of(content), str(content["name"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return TrainingRun(result.parent, name, training) if training is not None else None


def training_of(path: Path) -> Training | None:
    """Return how the policy in a file was trained, None where its contract does not say.

    Raises:
        PolicyFileError: the file cannot be used.
    """
    # Only policy files need torch, which takes seconds to load.
    from risk_dqn_planner.policies.policy_file import load_policy_file  # noqa: PLC0415

    return Training.of(load_policy_file(path).contract.get("training"))


def named_runs(
    runs: Iterable[TrainingRun], shipped: Iterable[ShippedPolicy] = ()
) -> dict[str, dict[int, TrainingRun]]:
    """Return the runs by the policy's name in tables and by their seed, in order of the seeds.

    A run that differs from a shipped policy's at most in its seed bears that policy's name; two
    trainings never share one, so that a second one is called after its folder.
    """
    names, taken = {}, set()
    for policy in shipped:
        taken.add(policy.name)
        training = training_of(policy.path)
        if training is not None:
            names[training.description] = policy.name
    found: dict[str, dict[int, TrainingRun]] = {}
    for run in sorted(runs, key=lambda run: run.training.seed):
        description = run.training.description
        if description not in names:
            names[description] = run.folder.name if run.name in taken else run.name
            taken.add(names[description])
        found.setdefault(names[description], {}).setdefault(run.training.seed, run)
    return found
