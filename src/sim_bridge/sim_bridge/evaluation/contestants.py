# SPDX-License-Identifier: Apache-2.0
"""Who takes part: names, files and factories, and all seeds that a shipped policy was trained with.

A shipped policy is one of its own training's seeds. The others are the finished runs that differ
from it in nothing but the seed; where there is none, the shipped one stands alone.
"""

import glob
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Policy
from risk_dqn_planner.policies.loading import BUILT_IN, load_policy
from risk_dqn_planner.policies.shipped import shipped_policies
from sim_bridge.evaluation.clairvoyant import NAME as CLAIRVOYANT
from sim_bridge.evaluation.rollout import Clairvoyant, Contestant, PolicyContestant
from sim_bridge.evaluation.training_runs import Training, named_runs, training_of, training_runs

LEARNED_POLICIES = ("risk_aware_paper", "collision_aware_paper", "tuned", "sound_dqn")
DEFAULT_POLICIES = ("rule_based", "always_fast", *LEARNED_POLICIES, CLAIRVOYANT)


def named_policies(text: str) -> list[str]:
    """Return the names in a list by commas; a pattern stands for the files that match it.

    Raises:
        ConfigurationError: no file matches.
    """
    names: list[str] = []
    for name in (part.strip() for part in text.split(",")):
        found = sorted(glob.glob(name)) if "*" in name else [name]  # noqa: PTH207 (any folder)
        if not found or not name:
            raise ConfigurationError(f"no policy file matches '{name}'")
        names += found
    return names


def contestants(names: Iterable[str], folders: Sequence[Path] = ()) -> list[Contestant]:
    """Return all that the names stand for, nobody twice.

    names: `clairvoyant`, or any name that `load_policy` takes. folders: where the training runs
    lie that add further seeds to shipped policies.

    Raises:
        PolicyError: a name stands for nothing that can be used.
        ConfigurationError: policies of two trainings have the same name.
    """
    found: dict[object, _Entry] = {}
    for name in names:
        for entry in _entries(name, folders):
            found.setdefault(entry.identity, entry)
    trained: dict[str, object] = {}
    for who, training in found.values():
        description = None if training is None else training.description
        if trained.setdefault(who.name, description) != description:
            raise ConfigurationError(
                f"two policies are called {who.name} but were not trained alike, expected a name "
                "for each training (train --name)"
            )
    return [entry.contestant for entry in found.values()]


class _Entry(NamedTuple):
    """Who takes part and how it was trained, None where nothing says so."""

    contestant: Contestant
    training: Training | None

    @property
    def identity(self) -> object:
        """What two entries of the same policy share: one seed counts once, trained anew or not."""
        who = self.contestant
        return (who.name, who.hash) if self.training is None else (who.name, self.training)


def _entries(name: str, folders: Sequence[Path]) -> list[_Entry]:
    if name == CLAIRVOYANT:
        return [_Entry(Clairvoyant(), None)]
    if name.endswith(".pt"):
        return [_from_file(Path(name), load_policy(name))]
    if name in BUILT_IN or ":" in name:
        return [_Entry(PolicyContestant(load_policy(name)), None)]
    # load_policy checks the file against its listed hash, and knows what to say of other names.
    policy, shipped = load_policy(name), shipped_policies()[name]
    runs = named_runs(training_runs(folders), [shipped]).get(name, {})
    seeds = [_from_file(run.policy, load_policy(str(run.policy)), name) for run in runs.values()]
    return [_from_file(shipped.path, policy), *seeds]


def _from_file(path: Path, policy: Policy, name: str | None = None) -> _Entry:
    training = training_of(path)
    seed = None if training is None else training.seed
    return _Entry(PolicyContestant(policy, seed, name), training)
