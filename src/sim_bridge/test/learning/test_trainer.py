# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from sim_bridge.environment.interface import Outcome
from sim_bridge.learning.config import EvaluationConfig, ExplorationConfig, TrainingConfig
from sim_bridge.learning.trainer import Progress, Trainer

from .toy import CONFIGURATION, Walk, learner, positions

LENGTH = 2


def trainer(config: TrainingConfig, outcome: Outcome = Outcome.SUCCESS, seed: int = 0) -> Trainer:
    environment = Walk(config.environments, LENGTH, outcome)
    return Trainer(config, environment, learner(config, seed), seed)


def values(one: Trainer) -> NDArray[np.float32]:
    """Q-values (position, action) of all positions."""
    return one.learner.q_values(positions(np.arange(LENGTH + 1))).copy()


def reports(one: Trainer) -> list[Progress]:
    return list(one.run())


@pytest.mark.parametrize("n_step", [1, 3])
def test_termination_does_not_bootstrap(n_step: int) -> None:
    one = trainer(replace(CONFIGURATION, n_step=n_step, exploration=ExplorationConfig(1.0, 1.0)))
    reports(one)
    # The step that ends the episode is worth its reward alone, whatever is said of what follows.
    assert values(one)[LENGTH - 1, 2] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("n_step", [1, 3])
def test_truncation_bootstraps_from_the_true_last_state(n_step: int) -> None:
    one = trainer(
        replace(CONFIGURATION, n_step=n_step, exploration=ExplorationConfig(1.0, 1.0)),
        Outcome.TIMEOUT,
    )
    reports(one)
    # The last state itself is never acted upon, so its values stay as they were drawn.
    last = values(one)[LENGTH].max()
    assert values(one)[LENGTH - 1, 2] == pytest.approx(1.0 + 0.5 * last, abs=0.02)


def test_waiting_forever_is_worth_the_geometric_sum() -> None:
    one = trainer(CONFIGURATION)
    reports(one)
    # 1 + 1/2 + 1/4 + ... = 2 for never going on.
    assert values(one)[0, :2] == pytest.approx(2.0, abs=0.05)


def test_what_is_not_sound_is_never_taken_and_all_else_is_tried_alike() -> None:
    walk = Walk(CONFIGURATION.environments, LENGTH, Outcome.SUCCESS, ruled_out=1)
    config = replace(CONFIGURATION, exploration=ExplorationConfig(1.0, 1.0))
    reports(Trainer(config, walk, learner(config), 0))
    stop, slow, fast = walk.taken.tolist()
    assert slow == 0
    # Of 1200 or more draws with even chances, 5 standard deviations are 87.
    assert abs(stop - fast) < 2 * 87


def test_where_staying_is_not_sound_the_end_is_all_there_is() -> None:
    walk = Walk(CONFIGURATION.environments, LENGTH, Outcome.SUCCESS, ruled_out=0)
    one = Trainer(CONFIGURATION, walk, learner(CONFIGURATION), 0)
    list(one.run())
    # Slow stays too and pays for ever: 2, and one step before the end it is 2 as well.
    assert values(one)[0, 1] == pytest.approx(2.0, abs=0.05)
    assert walk.taken[0] == 0


def test_same_seed_same_run_bit_for_bit() -> None:
    first, second, other = (trainer(CONFIGURATION, seed=seed) for seed in (0, 0, 1))
    for a, b in zip(reports(first), reports(second), strict=True):
        assert a.loss == b.loss
        assert a.ended.tolist() == b.ended.tolist()
    np.testing.assert_array_equal(values(first), values(second))
    reports(other)
    assert not np.array_equal(values(first), values(other))


def test_interrupted_and_resumed_equals_uninterrupted_bit_for_bit() -> None:
    config = replace(CONFIGURATION, n_step=3)
    whole = trainer(config)
    expected = reports(whole)
    begun = trainer(config)
    run = begun.run()
    before = [next(run), next(run)]
    resumed = trainer(config, seed=5)
    resumed.load_state_dict(begun.state_dict())
    found = before + reports(resumed)
    assert [r.steps for r in found] == [r.steps for r in expected]
    assert [r.loss for r in found] == [r.loss for r in expected]
    np.testing.assert_array_equal(values(resumed), values(whole))


def test_one_update_follows_every_step_once_warm() -> None:
    config = replace(CONFIGURATION, environments=1, steps=500, warmup_steps=100)
    last = reports(trainer(config))[-1]
    assert (last.steps, last.updates) == (500, 401)


def test_reports_come_every_so_many_episodes_and_at_the_end() -> None:
    config = replace(CONFIGURATION, environments=1, evaluation=EvaluationConfig(every_episodes=10))
    found = reports(trainer(config))
    assert [r.episodes for r in found[:-1]] == [10 * (k + 1) for k in range(len(found) - 1)]
    assert found[-1].steps == config.steps
    assert sum(int(r.ended[Outcome.SUCCESS]) for r in found) == found[-1].episodes


def test_epsilon_falls_linearly_then_stays() -> None:
    exploration = ExplorationConfig(start=1.0, end=0.2, share=0.5)
    found = [exploration.epsilon(p) for p in (0.0, 0.25, 0.5, 1.0)]
    assert found == pytest.approx([1.0, 0.6, 0.2, 0.2])


def test_random_actions_are_repeated_as_often_as_the_configuration_says() -> None:
    walk = Walk(1, LENGTH, Outcome.SUCCESS)
    config = replace(
        CONFIGURATION, environments=1, steps=3000, exploration=ExplorationConfig(1.0, 1.0, 0.0, 0.7)
    )
    actions = walk.follow()
    reports(Trainer(config, walk, learner(config), 0))
    same = np.mean(np.array(actions[1:]) == np.array(actions[:-1]))
    # Repeated, or drawn anew and the same by chance: 0.7 + 0.3 / 3; 0.03 is 4 standard deviations.
    assert same == pytest.approx(0.8, abs=0.03)


def test_repeated_exploration_resumes_bit_for_bit() -> None:
    config = replace(CONFIGURATION, exploration=ExplorationConfig(repeat=0.8))
    whole, begun, resumed = trainer(config), trainer(config), trainer(config, seed=5)
    reports(whole)
    next(begun.run())
    resumed.load_state_dict(begun.state_dict())
    reports(resumed)
    np.testing.assert_array_equal(values(resumed), values(whole))
