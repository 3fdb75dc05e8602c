# SPDX-License-Identifier: Apache-2.0
"""Learning from advice: the loss against torch, its memory, and a learner that follows it."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.learning.advice import Advice, AdviceMemory, advice_loss, empty_advice
from sim_bridge.learning.compiled_network import FEATURES
from sim_bridge.learning.config import AdviceConfig, LearnerConfig, TrainingConfig
from sim_bridge.learning.export import initial_weights
from sim_bridge.learning.learner import Learner

OUTLOOK = 9
SMALL = AdviceConfig(capacity=5, batch_size=4)


def numbered(first: int, count: int) -> Advice:
    """Advice that carries its number in every field."""
    advice = empty_advice(count, FEATURES)
    advice.states[:] = np.arange(first, first + count)[:, None]
    advice.action[:] = np.arange(first, first + count) % 3
    advice.sound[:] = True
    return advice


def test_the_loss_and_its_slope_are_those_of_a_cross_entropy_over_sound_actions() -> None:
    random = np.random.default_rng(0)
    q = random.normal(size=(6, 3)).astype(np.float32)
    sound = np.array([[1, 1, 1], [1, 1, 0], [0, 1, 1], [1, 1, 1], [1, 0, 1], [0, 0, 1]], dtype=bool)
    action = np.array([0, 1, 2, 2, 0, 2])
    values = torch.tensor(q, requires_grad=True)
    masked = (values / 0.2).masked_fill(~torch.tensor(sound), -torch.inf)
    expected = torch.nn.functional.cross_entropy(masked, torch.tensor(action))
    (slope,) = torch.autograd.grad(expected, values)
    by_q = np.empty_like(q)
    assert advice_loss(q, sound, action, 0.2, by_q) == pytest.approx(expected.item(), rel=1e-5)
    np.testing.assert_allclose(by_q, slope.numpy(), rtol=1e-4, atol=1e-7)


def test_the_memory_keeps_the_newest() -> None:
    memory = AdviceMemory(SMALL, FEATURES, seed=0)
    memory.add(numbered(0, 4))
    memory.add(numbered(4, 3))
    assert len(memory) == 5
    seen = {int(memory.sample().states[k, 0]) for _ in range(100) for k in range(4)}
    assert seen == {2, 3, 4, 5, 6}
    drawn = memory.sample()
    np.testing.assert_array_equal(drawn.action, drawn.states[:, 0] % 3)


def test_a_memory_that_is_taken_over_draws_the_same() -> None:
    first, second = AdviceMemory(SMALL, FEATURES, 0), AdviceMemory(SMALL, FEATURES, 7)
    first.add(numbered(0, 3))
    first.sample()
    second.load_state_dict(first.state_dict())
    for memory in (first, second):
        memory.add(numbered(3, 1))
    np.testing.assert_array_equal(first.sample().states, second.sample().states)


def test_a_learner_learns_what_it_is_told() -> None:
    config = LearnerConfig(learning_rate=3e-3, learning_rate_end=3e-3)
    learner = Learner(config, initial_weights(0, OUTLOOK))
    random = np.random.default_rng(1)
    states = random.uniform(-1, 1, (200, FEATURES + OUTLOOK)).astype(np.float32)
    # The action is told by the outlook alone, which follows the state.
    action = (states[:, FEATURES : FEATURES + 3]).argmax(axis=1)
    advice = Advice(states, np.ones((200, 3), dtype=np.bool_), action)
    losses = [learner.follow(advice, 1.0, 0.1, 0.0) for _ in range(300)]
    assert losses[-1] < 0.2 * losses[0]
    assert np.mean(learner.q_values(states).argmax(axis=1) == action) > 0.97


def test_advice_of_no_weight_changes_nothing() -> None:
    learner = Learner(LearnerConfig(), initial_weights(0))
    before = learner.weights.copy()
    learner.follow(numbered(0, 3), 0.0, 0.1, 0.0)
    np.testing.assert_array_equal(learner.weights, before)


def test_the_expert_hands_over_in_the_first_part_of_the_run() -> None:
    config = AdviceConfig(until=0.2)
    assert [config.driving(p) for p in (0.0, 0.1, 0.2, 1.0)] == [1.0, 0.5, 0.0, 0.0]
    assert AdviceConfig(until=0.0).driving(0.0) == 0.0
    falling = replace(config, weight=1.0, weight_end=0.0)
    assert [falling.weight_at(p) for p in (0.0, 0.25, 1.0)] == [1.0, 0.75, 0.0]


def test_advice_needs_an_outlook() -> None:
    with pytest.raises(ConfigurationError, match=r"TrainingConfig\.outlook is False"):
        TrainingConfig(advice=AdviceConfig())


@pytest.mark.parametrize(
    ("name", "value"),
    [("share", 1.1), ("until", -0.1), ("capacity", 0), ("weight", -1.0), ("temperature", 0.0)],
)
def test_a_number_that_makes_no_sense_is_refused_by_its_name(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=f"AdviceConfig.{name} is"):
        AdviceConfig(**{name: value})  # type: ignore[arg-type]
