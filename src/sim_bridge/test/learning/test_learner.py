# SPDX-License-Identifier: Apache-2.0
import copy

import numpy as np
import torch
from torch import nn

from sim_bridge.learning.config import LearnerConfig
from sim_bridge.learning.learner import Learner
from sim_bridge.learning.replay import Sample, Transitions


def network(seed: int) -> nn.Module:
    torch.manual_seed(seed)
    return nn.Sequential(nn.Linear(2, 4), nn.ReLU(), nn.Linear(4, 3))


def sample(discount: float = 0.99) -> Sample:
    random = np.random.default_rng(3)
    states = random.normal(size=(2, 8, 2)).astype(np.float32)
    return Sample(
        Transitions(
            s_tm1=states[0],
            a_tm1=random.integers(0, 3, 8),
            r_t=random.normal(size=8).astype(np.float32),
            discount_t=np.full(8, discount, dtype=np.float32),
            s_t=states[1],
        ),
        indices=np.arange(8),
        weights=random.random(8).astype(np.float32),
    )


def weights(module: nn.Module) -> torch.Tensor:
    return torch.cat([p.detach().reshape(-1) for p in module.parameters()])


def test_target_starts_as_the_online_network() -> None:
    online, target = network(0), network(1)
    Learner(LearnerConfig(), online, target)
    assert torch.equal(weights(online), weights(target))


def test_update_is_one_adam_step_on_the_double_q_loss() -> None:
    """The same update in plain autograd and plain Adam, parameter by parameter."""
    online, target = network(0), network(0)
    reference = copy.deepcopy(online)
    optimizer = torch.optim.Adam(reference.parameters(), lr=0.01)
    learner = Learner(LearnerConfig(learning_rate=0.01, learning_rate_end=0.01), online, target)
    drawn = sample()
    s_tm1, a_tm1, r_t, discount_t, s_t = (torch.from_numpy(x) for x in drawn.transitions)
    with torch.no_grad():
        best = reference(s_t).argmax(dim=1, keepdim=True)
        y = r_t + discount_t * target(s_t).gather(1, best).squeeze(1)
    errors = y - reference(s_tm1).gather(1, a_tm1[:, None]).squeeze(1)
    (torch.from_numpy(drawn.weights) * errors**2).mean().backward()
    optimizer.step()
    found, _ = learner.update(drawn, progress=0.0)
    np.testing.assert_allclose(found, errors.detach().numpy(), rtol=1e-5)
    torch.testing.assert_close(weights(online), weights(reference))


def test_target_moves_a_fifth_of_the_way_after_each_update() -> None:
    online, target = network(0), network(0)
    learner = Learner(LearnerConfig(learning_rate=0.01, target_rate=0.2), online, target)
    before = weights(target)
    learner.update(sample(), progress=0.0)
    torch.testing.assert_close(weights(target), before + 0.2 * (weights(online) - before))


def test_gradient_longer_than_the_limit_is_shortened_to_it() -> None:
    online = network(0)
    learner = Learner(LearnerConfig(max_gradient_norm=0.01), online, network(0))
    learner.update(sample(), progress=0.0)
    gradients = [p.grad.reshape(-1) for p in online.parameters() if p.grad is not None]
    torch.testing.assert_close(torch.cat(gradients).norm(), torch.tensor(0.01))


def test_learning_rate_falls_linearly_over_the_run() -> None:
    config = LearnerConfig(learning_rate=1e-3, learning_rate_end=1e-4)
    np.testing.assert_allclose(
        [config.rate(0.0), config.rate(0.5), config.rate(1.0)], [1e-3, 5.5e-4, 1e-4]
    )


def test_restored_learner_goes_on_bit_for_bit() -> None:
    learner = Learner(LearnerConfig(learning_rate=0.01), network(0), network(1))
    learner.update(sample(), progress=0.0)
    restored = Learner(LearnerConfig(learning_rate=0.01), network(5), network(6))
    restored.load_state_dict(learner.state_dict())
    for one in (learner, restored):
        one.update(sample(), progress=0.1)
    assert torch.equal(weights(learner.network), weights(restored.network))
    states = sample().transitions.s_t
    np.testing.assert_array_equal(learner.q_values(states), restored.q_values(states))


def test_values_of_a_terminal_batch_converge_to_its_rewards() -> None:
    learner = Learner(
        LearnerConfig(learning_rate=0.02, learning_rate_end=0.02), network(0), network(0)
    )
    drawn = sample(discount=0.0)
    first = learner.update(drawn, progress=0.0)[1]
    for _ in range(500):
        last = learner.update(drawn, progress=0.0)[1]
    assert last < 0.05 * first
