# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from risk_dqn_planner.policies.loading import load_policy
from sim_bridge.environment.episodes import drive
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.place import load_place
from sim_bridge.scenarios.loading import load_scenario


def test_every_episode_ends_and_its_outcome_fits_its_figures() -> None:
    simulation = load_place("four_way").simulation(load_scenario("base"), 40)
    driven = drive(simulation, load_policy("always_fast"), np.arange(40))
    assert sum(driven.share(outcome) for outcome in Outcome) == pytest.approx(1.0)
    assert driven.share(Outcome.RUNNING) == 0.0
    # Always-fast never waits: it arrives, or collides on the way, but runs out of no time.
    assert driven.share(Outcome.SUCCESS) > 0.0
    assert driven.share(Outcome.COLLISION) > 0.0
    assert driven.share(Outcome.TIMEOUT) == 0.0
    goal_s = driven.statistics.duration_s[driven.outcome == Outcome.SUCCESS]
    assert goal_s.max() < 30.0


def test_a_policy_that_stands_runs_into_the_time_limit() -> None:
    simulation = load_place("four_way").simulation(load_scenario("base"), 3)
    driven = drive(simulation, load_policy("always_stop"), np.arange(3))
    assert driven.share(Outcome.TIMEOUT) == 1.0
    assert driven.statistics.duration_s.tolist() == pytest.approx([60.0] * 3)
    assert driven.mean_speed_mps < 0.5
