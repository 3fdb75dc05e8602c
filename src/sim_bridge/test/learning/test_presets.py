# SPDX-License-Identifier: Apache-2.0
import pytest

from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.environment.rewards import reward_named
from sim_bridge.learning.config import LearnerConfig, ReplayConfig, TrainingConfig
from sim_bridge.learning.presets import preset_named


def test_paper_has_the_numbers_of_the_papers_table() -> None:
    paper = preset_named("paper")
    assert paper.learner.learning_rate == paper.learner.learning_rate_end == 1e-5
    assert paper.learner.target_rate == 0.2
    assert paper.batch_size == 16
    assert paper.replay.capacity == 50_000
    assert paper.gamma == 0.99
    risk = reward_named("risk")
    assert (risk.risk_weight, risk.utility_weight) == (0.8, 0.2)


def test_paper_learns_once_a_step_for_400000_steps_and_is_tried_as_the_paper_says() -> None:
    paper = preset_named("paper")
    assert (paper.steps, paper.environments, paper.updates_per_step) == (400_000, 1, 1)
    assert paper.n_step == 1
    assert paper.learner.max_gradient_norm is None
    assert (paper.evaluation.every_episodes, paper.evaluation.episodes) == (50, 20)


def test_numbers_out_of_range_are_refused_by_name() -> None:
    with pytest.raises(ConfigurationError, match=r"ReplayConfig.alpha is 1.5, expected 0 to 1"):
        ReplayConfig(alpha=1.5)
    with pytest.raises(ConfigurationError, match=r"LearnerConfig.learning_rate is 0.0"):
        LearnerConfig(learning_rate=0.0)
    with pytest.raises(ConfigurationError, match=r"TrainingConfig.steps is 0"):
        TrainingConfig(steps=0)
    with pytest.raises(ConfigurationError, match=r"TrainingConfig.warmup_steps is 60000"):
        TrainingConfig(warmup_steps=60_000)


def test_an_unknown_preset_is_refused_by_name() -> None:
    with pytest.raises(
        ConfigurationError, match="no preset 'fast', expected one of: advised, paper"
    ):
        preset_named("fast")
