# SPDX-License-Identifier: Apache-2.0
"""Drives whole episodes with a policy, all side by side, and says how each went."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.policies.base import Policy
from sim_bridge.environment.batch import outcomes
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.seeds import Seeds
from sim_bridge.simulation.simulation import EpisodeStatistics, Simulation


class DrivenEpisodes(NamedTuple):
    """N episodes: seed (N,), outcome (N,) by Outcome, and the simulation's statistics of them."""

    seed: Seeds
    outcome: NDArray[np.int64]
    statistics: EpisodeStatistics

    def share(self, outcome: Outcome) -> float:
        """Return the share of episodes that ended so."""
        return float(np.mean(self.outcome == outcome))

    @property
    def mean_speed_mps(self) -> float:
        """Mean over the episodes of each one's mean speed."""
        return float(self.statistics.mean_speed_mps.mean())


def drive(simulation: Simulation, policy: Policy, seeds: Seeds) -> DrivenEpisodes:
    """Drive the episodes of seeds (N,) to their ends; the simulation's batch must be N."""
    simulation.reset(seeds)
    outcome = np.full(len(seeds), Outcome.RUNNING, dtype=np.int64)
    restart = np.ones(len(seeds), dtype=np.bool_)
    situations = simulation.situations()
    while (outcome == Outcome.RUNNING).any():
        actions = policy.decide(situations, restart).action
        outcome += outcomes(simulation.step(actions))
        restart[:] = False
        simulation.situations(out=situations)
    return DrivenEpisodes(seeds, outcome, simulation.statistics())
