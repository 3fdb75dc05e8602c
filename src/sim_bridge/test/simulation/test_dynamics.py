# SPDX-License-Identifier: Apache-2.0
import pytest
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.decision import Action
from sim_bridge.simulation.dynamics import accelerate, follow_target, target_speed

speeds = st.floats(0.0, 10.0)


def ego(speed: float, target: float, time_s: float) -> tuple[float, float]:
    return follow_target(speed, target, time_s, 1.5, 3.5)


@pytest.mark.parametrize(
    ("action", "speed"), [(Action.STOP, 0), (Action.SLOW, 1), (Action.FAST, 5)]
)
def test_actions_aim_at_their_speeds(action: Action, speed: float):
    assert target_speed(int(action), 1.0, 5.0) == speed


def test_the_ego_needs_v_squared_over_2a_to_stop():
    # 5^2 / (2 * 3.5) = 3.5714 m in 1.4286 s; it then stands.
    assert ego(5.0, 0.0, 3.0) == pytest.approx((25.0 / 7.0, 0.0))


def test_the_ego_speeds_up_exactly_to_its_target_and_keeps_it():
    # From 4 to 5 m/s in 2/3 s at a mean of 4.5 m/s, then 1/3 s at 5 m/s.
    assert ego(4.0, 5.0, 1.0) == pytest.approx((4.5 * 2.0 / 3.0 + 5.0 / 3.0, 5.0))


def test_the_ego_brakes_down_to_slow_and_no_further():
    # From 5 to 1 m/s in 4/3.5 s at a mean of 3 m/s, then at 1 m/s.
    ramp = 4.0 / 3.5
    assert ego(5.0, 1.0, 2.0) == pytest.approx((3.0 * ramp + (2.0 - ramp), 1.0))


@given(speeds, st.sampled_from([0.0, 1.0, 5.0]))
def test_five_inner_steps_are_one_step_of_half_a_second(speed: float, target: float):
    way, at = 0.0, speed
    for _ in range(5):
        more, at = ego(at, target, 0.1)
        way += more
    assert (way, at) == pytest.approx(ego(speed, target, 0.5), abs=1e-9)


@given(speeds, st.sampled_from([0.0, 1.0, 5.0]))
def test_the_ego_never_passes_its_target_speed(speed: float, target: float):
    way, after = ego(speed, target, 0.5)
    assert min(speed, target) <= after <= max(speed, target)
    assert way >= 0.0


def test_a_vehicle_under_constant_acceleration_covers_the_mean_speed():
    assert accelerate(4.0, 2.0, 0.5) == pytest.approx((2.25, 5.0))


def test_a_braking_vehicle_stops_within_a_step_and_does_not_roll_back():
    # 0.5 m/s at -8 m/s^2: stands after 0.0625 s and 0.015625 m.
    assert accelerate(0.5, -8.0, 0.1) == pytest.approx((0.015625, 0.0))
    assert accelerate(0.0, -8.0, 0.1) == (0.0, 0.0)
