# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from sim_bridge.learning.losses import double_q_target, rule_out, weighted_loss, weighted_loss_slope


def q(*values: float) -> NDArray[np.float32]:
    return np.array(values, dtype=np.float32)


def test_online_network_chooses_and_target_network_values() -> None:
    # The online network prefers action 2, which the target values at 10, not at its own best 30.
    assert double_q_target(1.0, 0.5, q(1, 2, 3), q(30, 20, 10)) == 6.0


def test_an_action_that_is_ruled_out_is_not_chosen() -> None:
    online = q(1, 2, 3)
    rule_out(online, np.array([True, True, False]))
    assert double_q_target(1.0, 0.5, online, q(30, 20, 10)) == 11.0


def test_a_terminated_step_is_worth_its_reward_alone() -> None:
    assert double_q_target(-2.0, 0.0, q(1, 2, 3), q(9, 9, 9)) == -2.0


def test_loss_is_the_weighted_mean_square() -> None:
    # (1 * 3^2 + 0.5 * 2^2) / 2
    assert weighted_loss(3.0, 1.0, 2) + weighted_loss(-2.0, 0.5, 2) == 5.5


@settings(deadline=None)
@given(st.floats(-3, 3), st.floats(0, 1), st.integers(1, 100), st.floats(-3, 3))
def test_slope_is_the_derivative_of_the_loss_by_the_estimate(
    target: float, weight: float, batch: int, estimate: float
) -> None:
    step = 1e-3
    above = weighted_loss(target - (estimate + step), weight, batch)
    below = weighted_loss(target - (estimate - step), weight, batch)
    slope = weighted_loss_slope(target - estimate, weight, batch)
    assert slope == pytest.approx((above - below) / (2 * step), abs=1e-9)
