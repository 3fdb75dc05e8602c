# SPDX-License-Identifier: Apache-2.0
import numpy as np
import torch
from numpy.typing import NDArray

from sim_bridge.learning.losses import (
    double_q_targets,
    td_errors,
    weighted_loss,
    weighted_loss_gradient,
)


def floats(*values: object) -> NDArray[np.float32]:
    return np.array(values, dtype=np.float32)


def test_online_network_chooses_and_target_network_values() -> None:
    # The online network prefers action 2, which the target values at 10, not at its own best 30.
    target = double_q_targets(floats(1.0), floats(0.5), floats([1, 2, 3]), floats([30, 20, 10]))
    assert target.tolist() == [6.0]


def test_a_terminated_step_is_worth_its_reward_alone() -> None:
    target = double_q_targets(floats(-2.0), floats(0.0), floats([1, 2, 3]), floats([9, 9, 9]))
    assert target.tolist() == [-2.0]


def test_td_error_is_target_less_value_of_the_action_taken() -> None:
    q_values = floats([1, 2, 3], [4, 5, 6])
    assert td_errors(q_values, np.array([1, 0]), floats(5.0, 1.0)).tolist() == [3.0, -3.0]


def test_loss_is_the_weighted_mean_square() -> None:
    # (1 * 3^2 + 0.5 * 2^2) / 2
    assert weighted_loss(floats(3.0, -2.0), floats(1.0, 0.5)) == 5.5


def test_gradient_is_that_of_automatic_differentiation() -> None:
    random = np.random.default_rng(0)
    q_values = random.normal(size=(7, 3)).astype(np.float32)
    targets, weights = random.normal(size=(2, 7)).astype(np.float32)
    actions = random.integers(0, 3, 7)
    q = torch.tensor(q_values, requires_grad=True)
    chosen = q.gather(1, torch.from_numpy(actions)[:, None]).squeeze(1)
    loss = (torch.from_numpy(weights) * (torch.from_numpy(targets) - chosen) ** 2).mean()
    torch.autograd.backward(loss)
    errors = td_errors(q_values, actions, targets)
    assert q.grad is not None
    np.testing.assert_allclose(
        weighted_loss_gradient(errors, weights, actions, 3), q.grad.numpy(), rtol=1e-5
    )
    np.testing.assert_allclose(weighted_loss(errors, weights), loss.item(), rtol=1e-5)
