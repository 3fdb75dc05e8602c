# SPDX-License-Identifier: Apache-2.0
"""The compiled learner against torch: automatic differentiation and torch's own Adam."""

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from torch.nn.utils import parameters_to_vector, vector_to_parameters

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.network import OutlookDqn, RiskDqn
from sim_bridge.learning import compiled_network
from sim_bridge.learning.compiled_network import FEATURES, empty_signals
from sim_bridge.learning.config import LearnerConfig
from sim_bridge.learning.dense import Array
from sim_bridge.learning.learner import Learner
from sim_bridge.learning.replay import Sample, Transitions


def network(weights: Array) -> RiskDqn:
    module = RiskDqn()
    vector_to_parameters(torch.from_numpy(weights.copy()), module.parameters())
    return module


def flat(tensors: list[torch.Tensor]) -> Array:
    array: Array = parameters_to_vector(tensors).detach().numpy()
    return array


def initial_weights(seed: int) -> Array:
    torch.manual_seed(seed)
    return flat(list(RiskDqn().parameters()))


def states(count: int, seed: int = 0) -> NDArray[np.float32]:
    return np.random.default_rng(seed).uniform(-1, 1, (count, FEATURES)).astype(np.float32)


def as_tensor(flat_states: NDArray[np.float32]) -> torch.Tensor:
    return torch.from_numpy(flat_states).reshape(-1, 5, 3, 8)


def sample(discount: float = 0.99, count: int = 16) -> Sample:
    random = np.random.default_rng(3)
    return Sample(
        Transitions(
            s_tm1=states(count, 1),
            a_tm1=random.integers(0, 3, count),
            r_t=random.normal(size=count).astype(np.float32),
            discount_t=np.full(count, discount, dtype=np.float32),
            s_t=states(count, 2),
            sound_t=np.ones((count, 3), dtype=np.bool_),
        ),
        indices=np.arange(count),
        weights=random.random(count).astype(np.float32),
    )


@pytest.mark.parametrize("count", [1, 2, 7, 16, 70])
def test_values_are_those_of_the_torch_module(count: int) -> None:
    weights = initial_weights(0)
    learner = Learner(LearnerConfig(), weights)
    with torch.no_grad():
        expected = network(weights)(as_tensor(states(count))).numpy()
    np.testing.assert_allclose(learner.q_values(states(count)), expected, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("count", [1, 2, 7, 16, 70])
def test_gradient_is_that_of_automatic_differentiation(count: int) -> None:
    weights = initial_weights(0)
    by_q = np.random.default_rng(5).normal(size=(count, 3)).astype(np.float32)
    module = network(weights)
    q = module(as_tensor(states(count)))
    expected = torch.autograd.grad(q, list(module.parameters()), torch.from_numpy(by_q))
    signals, by = empty_signals(count), empty_signals(count)
    compiled_network.values(weights, states(count), signals)
    by.q[:] = by_q
    found = np.empty_like(weights)
    compiled_network.gradient(weights, signals, by, found)
    np.testing.assert_allclose(found, flat(list(expected)), rtol=1e-3, atol=1e-5)


def test_updates_are_adam_steps_on_the_double_q_loss() -> None:
    weights = initial_weights(0)
    learner = Learner(LearnerConfig(learning_rate=0.01, learning_rate_end=0.01), weights)
    online, target = network(weights), network(weights)
    optimizer = torch.optim.Adam(online.parameters(), lr=0.01)
    drawn = sample()
    s_tm1, a_tm1, r_t, discount_t, s_t, _ = (torch.from_numpy(x) for x in drawn.transitions)
    s_tm1, s_t = s_tm1.reshape(-1, 5, 3, 8), s_t.reshape(-1, 5, 3, 8)
    for _ in range(3):
        with torch.no_grad():
            best = online(s_t).argmax(dim=1, keepdim=True)
            y = r_t + discount_t * target(s_t).gather(1, best).squeeze(1)
        errors = y - online(s_tm1).gather(1, a_tm1[:, None]).squeeze(1)
        loss = (torch.from_numpy(drawn.weights) * errors**2).mean()
        optimizer.zero_grad()
        torch.autograd.backward(loss)
        optimizer.step()
        with torch.no_grad():
            for slow, fast in zip(target.parameters(), online.parameters(), strict=True):
                slow.lerp_(fast, 0.2)
        found_errors, found_loss = learner.update(drawn, progress=0.0)
        np.testing.assert_allclose(found_errors, errors.detach().numpy(), rtol=1e-3, atol=1e-5)
        assert found_loss == pytest.approx(loss.item(), rel=1e-4)
    np.testing.assert_allclose(
        learner.weights, flat(list(online.parameters())), rtol=1e-3, atol=1e-4
    )


def test_the_target_is_the_value_of_the_best_sound_action() -> None:
    weights, drawn = initial_weights(0), sample()
    only = np.random.default_rng(7).integers(0, 3, 16)
    drawn.transitions.sound_t[:] = only[:, None] == np.arange(3)
    next_q = Learner(LearnerConfig(), weights).q_values(drawn.transitions.s_t).copy()
    now_q = Learner(LearnerConfig(), weights).q_values(drawn.transitions.s_tm1).copy()
    errors, _ = Learner(LearnerConfig(), weights).update(drawn, progress=0.0)
    rows = np.arange(16)
    y = drawn.transitions.r_t + 0.99 * next_q[rows, only]
    expected = y - now_q[rows, drawn.transitions.a_tm1]
    np.testing.assert_allclose(errors, expected, rtol=1e-4, atol=1e-5)


def test_target_moves_a_fifth_of_the_way_after_each_update() -> None:
    learner = Learner(LearnerConfig(learning_rate=0.01, target_rate=0.2), initial_weights(0))
    before = learner.state_dict()
    learner.update(sample(), progress=0.0)
    after = learner.state_dict()
    expected = before["target"] + 0.2 * (after["online"] - before["target"])
    np.testing.assert_allclose(after["target"], expected, rtol=1e-5, atol=1e-7)


def test_gradient_longer_than_the_limit_is_shortened_to_it() -> None:
    # Adam's first moment after one step is a tenth of the gradient.
    learner = Learner(LearnerConfig(max_gradient_norm=0.01), initial_weights(0))
    learner.update(sample(), progress=0.0)
    moment = learner.state_dict()["adam_mean"]
    assert np.linalg.norm(10.0 * moment) == pytest.approx(0.01, rel=1e-4)


def test_learning_rate_falls_linearly_over_the_run() -> None:
    config = LearnerConfig(learning_rate=1e-3, learning_rate_end=1e-4)
    assert [config.rate(p) for p in (0.0, 0.5, 1.0)] == pytest.approx([1e-3, 5.5e-4, 1e-4])


def test_restored_learner_goes_on_bit_for_bit() -> None:
    learner = Learner(LearnerConfig(learning_rate=0.01), initial_weights(0))
    learner.update(sample(), progress=0.0)
    restored = Learner(LearnerConfig(learning_rate=0.01), initial_weights(5))
    restored.load_state_dict(learner.state_dict())
    for one in (learner, restored):
        one.update(sample(), progress=0.1)
    for name, array in learner.state_dict().items():
        np.testing.assert_array_equal(array, restored.state_dict()[name])


def test_values_of_a_terminal_batch_converge_to_its_rewards() -> None:
    learner = Learner(LearnerConfig(learning_rate=0.002), initial_weights(0))
    drawn = sample(discount=0.0)
    first = learner.update(drawn, progress=0.0)[1]
    for _ in range(300):
        last = learner.update(drawn, progress=0.0)[1]
    assert last < 1e-3 * first


def test_a_network_with_an_outlook_is_that_of_the_torch_module_too() -> None:
    outlook, count = 7, 21
    torch.manual_seed(0)
    module = OutlookDqn(outlook)
    weights = flat(list(module.parameters()))
    more = np.random.default_rng(8).uniform(-1, 1, (count, outlook)).astype(np.float32)
    by_q = np.random.default_rng(5).normal(size=(count, 3)).astype(np.float32)
    q = module(as_tensor(states(count)), torch.from_numpy(more))
    expected = torch.autograd.grad(q, list(module.parameters()), torch.from_numpy(by_q))
    told = np.concatenate((states(count), more), axis=1)
    signals, by = empty_signals(count, outlook), empty_signals(count, outlook)
    compiled_network.values(weights, told, signals)
    np.testing.assert_allclose(signals.q, q.detach().numpy(), rtol=1e-4, atol=1e-6)
    by.q[:] = by_q
    found = np.empty_like(weights)
    compiled_network.gradient(weights, signals, by, found)
    np.testing.assert_allclose(found, flat(list(expected)), rtol=1e-3, atol=1e-5)
    assert len(weights) == compiled_network.WEIGHTS + compiled_network.HIDDEN * outlook
    assert compiled_network.outlook_of(len(weights)) == outlook


def test_states_of_another_size_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="states have 127 numbers, expected 120"):
        Learner(LearnerConfig(), initial_weights(0)).q_values(np.zeros((2, 127), dtype=np.float32))
