# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.safety.guard import Guard
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


def guarded(batch: int, scenario: str = "base", reward: str = "progress") -> BatchEnvironment:
    return BatchEnvironment(
        place().simulation(load_scenario(scenario), batch),
        StateEncoder(),
        reward_named(reward),
        RiskConfig(),
        run_seed=0,
        guard=Guard(),
    )


def any_sound(one: BatchEnvironment, random: np.random.Generator) -> NDArray[np.int64]:
    """Draw among the sound actions of each row."""
    drawn: NDArray[np.int64] = np.where(one.sound, random.random((one.batch, 3)), -1.0).argmax(
        axis=1
    )
    return drawn


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


def test_without_a_guard_every_action_is_sound() -> None:
    one = environment(3)
    one.reset()
    one.step(fast(3))
    assert one.sound.shape == (3, 3)
    assert one.sound.all()


@pytest.mark.parametrize("scenario", ["base", "dense_traffic", "severe_occlusion"])
def test_what_takes_only_sound_actions_never_collides(scenario: str) -> None:
    one, random = guarded(64, scenario), np.random.default_rng(2)
    one.reset()
    ruled_out, ended = 0, 0
    for _ in range(150):
        assert one.sound.any(axis=1).all()
        ruled_out += int((~one.sound).sum())
        outcome = one.step(any_sound(one, random)).outcome
        assert not (outcome == Outcome.COLLISION).any()
        ended += int((outcome == Outcome.SUCCESS).sum())
    assert ruled_out > 100
    assert ended > 0 or scenario == "severe_occlusion"


def test_switching_and_hard_braking_are_priced_as_the_statistics_count_them() -> None:
    one = environment(4, reward="progress")
    one.reset()
    changes, brakes = np.zeros(4, dtype=np.int64), np.zeros(4, dtype=np.int64)
    for action in (2, 2, 2, 2, 0, 0, 1, 1):
        step = one.step(np.full(4, action, dtype=np.int64))
        assert (step.outcome == Outcome.RUNNING).all()
        statistics = one.simulation.statistics()
        now = statistics.action_changes - changes, statistics.hard_brakes - brakes
        assert step.reward == pytest.approx(-0.01 - 0.05 * now[0] - 0.03 * now[1])
        changes, brakes = statistics.action_changes, statistics.hard_brakes
    assert changes.tolist() == [2] * 4
    assert (brakes > 0).all()


def test_a_guarded_environment_goes_on_identically_when_restored() -> None:
    one, other, random = guarded(8), guarded(8), np.random.default_rng(0)
    one.reset()
    for _ in range(40):
        one.step(any_sound(one, random))
    other.load_state_dict(one.state_dict())
    for _ in range(60):
        np.testing.assert_array_equal(one.sound, other.sound)
        actions = any_sound(one, random)
        for a, b in zip(one.step(actions), other.step(actions), strict=True):
            np.testing.assert_array_equal(a, b)
