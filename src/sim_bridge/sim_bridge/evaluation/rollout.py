# SPDX-License-Identifier: Apache-2.0
"""Drives many episodes in batches; every contestant gets the same ones."""

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.policies.base import Policy
from sim_bridge.environment.episodes import DrivenEpisodes, drive
from sim_bridge.environment.seeds import Seeds
from sim_bridge.evaluation.clairvoyant import NAME as CLAIRVOYANT
from sim_bridge.evaluation.clairvoyant import ClairvoyantPolicy, optima
from sim_bridge.evaluation.known import KnownOptima
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
    """Any policy, by its own name unless it is given another one."""

    def __init__(
        self, policy: Policy, training_seed: int | None = None, name: str | None = None
    ) -> None:
        self._policy = policy
        self.training_seed = training_seed
        self.name = name or policy.name

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

    def __init__(self) -> None:
        self._known = KnownOptima()

    @property
    def hash(self) -> str:
        """SHA-256 of the name."""
        return ClairvoyantPolicy(np.empty((0, 0), dtype=np.int64)).hash

    def drive(self, simulation: Simulation, seeds: Seeds) -> Driven:
        """Search each episode's optimum and drive it.

        Raises:
            ScenarioError: the traffic reacts to the ego.
        """
        found = optima(simulation, seeds, known=self._known)
        episodes = drive(simulation, ClairvoyantPolicy(found.actions), seeds)
        return Driven(episodes, found.proven)


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
