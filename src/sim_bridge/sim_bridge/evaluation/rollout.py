# SPDX-License-Identifier: Apache-2.0
"""Drives many episodes in batches; every contestant gets the same ones."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.policies.base import Policy
from risk_dqn_planner.policies.loading import load_policy
from sim_bridge.environment.episodes import DrivenEpisodes, drive
from sim_bridge.environment.seeds import Seeds
from sim_bridge.evaluation.clairvoyant import NAME as CLAIRVOYANT
from sim_bridge.evaluation.clairvoyant import ClairvoyantPolicy, optima
from sim_bridge.simulation.simulation import EpisodeStatistics, Simulation


class Driven(NamedTuple):
    """N episodes, and whether the way driven is proven to be the fastest one (N,)."""

    episodes: DrivenEpisodes
    optimal: NDArray[np.bool_]


class Contestant(Protocol):
    """What can be evaluated."""

    @property
    def name(self) -> str:
        """Name in tables; policies of one training with several seeds share it."""

    @property
    def hash(self) -> str:
        """SHA-256 of what decides."""

    @property
    def training_seed(self) -> int | None:
        """Seed of the training run, None for what was not trained."""

    def drive(self, simulation: Simulation, seeds: Seeds) -> Driven:
        """Drive the episodes of seeds (B,), B the simulation's batch."""


class PolicyContestant:
    """Any policy."""

    def __init__(self, policy: Policy, training_seed: int | None = None) -> None:
        self._policy = policy
        self.training_seed = training_seed

    @property
    def name(self) -> str:
        """Name of the policy."""
        return self._policy.name

    @property
    def hash(self) -> str:
        """SHA-256 of the policy."""
        return self._policy.hash

    def drive(self, simulation: Simulation, seeds: Seeds) -> Driven:
        """Let the policy decide on what it perceives."""
        return Driven(drive(simulation, self._policy, seeds), np.zeros(len(seeds), dtype=np.bool_))


class Clairvoyant:
    """The optimum of each episode, driven in the simulation like any policy."""

    name = CLAIRVOYANT
    training_seed = None

    @property
    def hash(self) -> str:
        """SHA-256 of the name."""
        return ClairvoyantPolicy(np.empty((0, 0), dtype=np.int64)).hash

    def drive(self, simulation: Simulation, seeds: Seeds) -> Driven:
        """Search each episode's optimum and drive it.

        Raises:
            ScenarioError: the traffic reacts to the ego.
        """
        found = optima(simulation, seeds)
        episodes = drive(simulation, ClairvoyantPolicy(found.actions), seeds)
        return Driven(episodes, found.proven)


def contestant(name: str) -> Contestant:
    """Return what a name stands for: `clairvoyant`, or any name that `load_policy` takes.

    Raises:
        PolicyError: the name stands for nothing that can be used.
    """
    if name == CLAIRVOYANT:
        return Clairvoyant()
    policy = load_policy(name)
    return PolicyContestant(policy, _training_seed(name) if name.endswith(".pt") else None)


def _training_seed(path: str) -> int | None:
    # Only policy files need torch, which takes seconds to load.
    from risk_dqn_planner.policies.policy_file import load_policy_file  # noqa: PLC0415

    training = load_policy_file(path).contract.get("training", {})
    run = training.get("run", {}) if isinstance(training, Mapping) else {}
    seed: Any = run.get("seed")
    return seed if isinstance(seed, int) else None


def roll_out(simulation: Simulation, driver: Contestant, seeds: Seeds) -> Iterator[Driven]:
    """Drive the episodes of seeds (N,) batch by batch; the result is the same for any batch."""
    batch = simulation.batch
    for begin in range(0, len(seeds), batch):
        chosen = seeds[begin : begin + batch]
        # A last batch that is not full drives its last episode several times.
        padded = np.concatenate((chosen, np.full(batch - len(chosen), chosen[-1])))
        yield _first(driver.drive(simulation, padded), len(chosen))


def _first(driven: Driven, count: int) -> Driven:
    seed, outcome, statistics = driven.episodes
    cut = EpisodeStatistics._make(array[:count] for array in statistics)
    return Driven(DrivenEpisodes(seed[:count], outcome[:count], cut), driven.optimal[:count])


def joined(parts: list[Driven]) -> Driven:
    """Put the batches of one evaluation together, in order."""
    episodes = [part.episodes for part in parts]
    columns = zip(*(part.statistics for part in episodes), strict=True)
    return Driven(
        DrivenEpisodes(
            np.concatenate([part.seed for part in episodes]),
            np.concatenate([part.outcome for part in episodes]),
            EpisodeStatistics._make(np.concatenate(column) for column in columns),
        ),
        np.concatenate([part.optimal for part in parts]),
    )
