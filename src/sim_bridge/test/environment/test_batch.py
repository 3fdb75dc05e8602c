# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.batch import BatchEnvironment
from sim_bridge.environment.interface import EnvironmentStep, Outcome
from sim_bridge.environment.place import Place, load_place
from sim_bridge.environment.rewards import reward_named
from sim_bridge.environment.seeds import training_seeds
from sim_bridge.scenarios.fields import Timing
from sim_bridge.scenarios.loading import load_scenario
from sim_bridge.simulation.simulation import Simulation


@lru_cache
def place() -> Place:
    return load_place("four_way")


def simulation(batch: int, limit_s: float = 60.0) -> Simulation:
    base = load_scenario("base")
    return place().simulation(replace(base, timing=Timing(limit_s=limit_s)), batch)


def environment(
    batch: int, limit_s: float = 60.0, seed: int = 0, reward: str = "collision"
) -> BatchEnvironment:
    return BatchEnvironment(
        simulation(batch, limit_s), StateEncoder(), reward_named(reward), RiskConfig(), seed
    )


def keep(step: EnvironmentStep) -> EnvironmentStep:
    return EnvironmentStep._make(array.copy() for array in step)


def fast(batch: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.full(batch, Action.FAST, dtype=np.int64)


def test_time_limit_is_no_terminal_state() -> None:
    one = environment(3, limit_s=1.0)
    one.reset()
    stop = np.zeros(3, dtype=np.int64)
    one.step(stop)
    last = one.step(stop)
    assert last.outcome.tolist() == [Outcome.TIMEOUT] * 3
    assert last.discount.tolist() == [1.0] * 3
    assert last.reward == pytest.approx(-0.00001)


def test_goal_and_collision_are_terminal_and_pay_once() -> None:
    one = environment(64)
    one.reset()
    seen = set()
    for _ in range(60):
        step = one.step(fast(64))
        success = step.outcome == Outcome.SUCCESS
        collision = step.outcome == Outcome.COLLISION
        seen |= set(step.outcome.tolist())
        assert (step.reward[success] == 1.0).all()
        assert (step.reward[collision] == -2.0).all()
        assert ((step.discount == 0.0) == (success | collision)).all()
        others = step.taken & ~success & ~collision
        assert step.reward[others] == pytest.approx(-0.00001)
    assert seen == {Outcome.RUNNING, Outcome.SUCCESS, Outcome.COLLISION}


def test_the_step_after_an_end_begins_the_next_episode_and_takes_no_action() -> None:
    one = environment(8)
    one.reset()
    for _ in range(100):
        ended = keep(one.step(fast(8))).outcome != Outcome.RUNNING
        if ended.any():
            break
    step = one.step(fast(8))
    np.testing.assert_array_equal(step.taken, ~ended)
    scenes = step.states.reshape(8, 5, 3, 8)
    for row in np.flatnonzero(ended):
        # Nothing is remembered: all five scenes are the first one of the new episode.
        assert (scenes[row] == scenes[row, :1]).all()
        assert step.outcome[row] == Outcome.RUNNING


def test_episodes_are_those_of_the_training_seeds() -> None:
    one = environment(2, seed=7)
    states = one.reset().copy()
    apart = simulation(2)
    apart.reset(training_seeds(7, np.zeros(2, dtype=np.int64)))
    expected = StateEncoder().encode(apart.situations(), np.ones(2, dtype=np.bool_))
    np.testing.assert_array_equal(states, expected.reshape(2, -1))


def test_a_row_of_a_batch_is_the_environment_of_a_batch_of_one() -> None:
    actions = np.random.default_rng(0).integers(0, 3, (80, 3))
    together, alone = environment(3), environment(1)
    np.testing.assert_array_equal(together.reset()[0], alone.reset()[0])
    for row in actions:
        first, second = together.step(row), alone.step(row[:1])
        for name in EnvironmentStep._fields:
            np.testing.assert_array_equal(getattr(first, name)[:1], getattr(second, name))


def test_restored_environment_goes_on_identically() -> None:
    actions = np.random.default_rng(1).integers(1, 3, (90, 4))
    one = environment(4, reward="risk")
    one.reset()
    for row in actions[:30]:
        one.step(row)
    other = environment(4, reward="risk", seed=0)
    other.load_state_dict(one.state_dict())
    for row in actions[30:]:
        for a, b in zip(one.step(row), other.step(row), strict=True):
            np.testing.assert_array_equal(a, b)


def test_given_seeds_begin_those_episodes() -> None:
    one, other = environment(2), environment(2, seed=5)
    np.testing.assert_array_equal(one.reset(np.array([3, 4])), other.reset(np.array([3, 4])))
