# SPDX-License-Identifier: Apache-2.0
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.risk.motion import distance_after, time_to_travel
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.course import (
    BRAKE,
    GO,
    begin_course,
    speed_at,
    time_at,
    way_at,
    with_manoeuvre,
)

NUMBERS = SafetyAssumptions().numbers()
DELAYED = SafetyAssumptions(actuation_delay_s=0.3).numbers()
speeds = st.floats(0.0, 5.0)
targets = st.sampled_from([0.0, 1.0, 5.0])


def test_braking_covers_a_distance_before_it_comes_to_rest() -> None:
    # 3 t - 1.75 t^2 = 1: t = (3 - sqrt(2)) / 3.5.
    assert time_to_travel(1.0, 3.0, 0.0, 1.5, 3.5) == pytest.approx((3.0 - math.sqrt(2.0)) / 3.5)
    assert time_to_travel(1.3, 3.0, 0.0, 1.5, 3.5) == math.inf


def test_slowing_down_to_a_target_that_is_then_kept() -> None:
    # From 5 to 1 m/s in 8/7 s and 24/7 m, then 1 m more.
    assert time_to_travel(24.0 / 7.0 + 1.0, 5.0, 1.0, 1.5, 3.5) == pytest.approx(8.0 / 7.0 + 1.0)


@settings(deadline=None)
@given(
    time_s=st.floats(0.01, 20.0),
    speed_mps=st.floats(0.0, 15.0),
    target_mps=st.floats(0.1, 15.0),
)
def test_time_to_travel_inverts_distance_after(
    time_s: float, speed_mps: float, target_mps: float
) -> None:
    way_m = distance_after(time_s, speed_mps, target_mps, 1.5, 3.5)
    assert time_to_travel(way_m, speed_mps, target_mps, 1.5, 3.5) == pytest.approx(
        time_s, rel=1e-6, abs=1e-6
    )


def test_fast_and_then_braking_by_hand() -> None:
    # From 2 m/s: 0.5 s to 2.75 m/s, 1.1875 m; then 2.75^2 / 7 = 1.0804 m in 0.7857 s.
    course = with_manoeuvre(begin_course(2.0, 0.0, 5.0, NUMBERS), BRAKE, NUMBERS)
    assert course.rest_m == pytest.approx(2.26786, abs=1e-5)
    assert speed_at(course, 0.5, NUMBERS) == pytest.approx(2.75)
    assert speed_at(course, 2.0, NUMBERS) == 0.0
    assert way_at(course, 9.0, NUMBERS) == pytest.approx(course.rest_m)
    assert time_at(course, 2.3, NUMBERS) == math.inf


def test_slowing_lasts_until_the_target_is_reached() -> None:
    # From 2 to 1 m/s takes 2/7 s of the period.
    course = begin_course(2.0, 0.0, 1.0, NUMBERS)
    assert course.slowing_until_s == pytest.approx(2.0 / 7.0)
    assert begin_course(2.0, 0.0, 5.0, NUMBERS).slowing_until_s == 0.0
    # During a delay in which Stop is in force the ego slows down too.
    assert begin_course(2.0, 0.0, 5.0, DELAYED).slowing_until_s == pytest.approx(0.3)


@settings(deadline=None)
@given(
    v0=speeds,
    in_force=targets,
    target=targets,
    periods=st.sampled_from([BRAKE, 1, 3, GO]),
    time_s=st.floats(0.0, 15.0),
)
def test_ways_times_and_speeds_of_a_course_agree(
    v0: float, in_force: float, target: float, periods: int, time_s: float
) -> None:
    course = with_manoeuvre(begin_course(v0, in_force, target, DELAYED), periods, DELAYED)
    way_m, mps = way_at(course, time_s, DELAYED), speed_at(course, time_s, DELAYED)
    assert 0.0 <= mps <= 5.0 + 1e-9
    assert way_m <= course.rest_m + 1e-9
    step_s = 1e-6
    ahead_m = way_at(course, time_s + step_s, DELAYED)
    assert ahead_m - way_m == pytest.approx(mps * step_s, abs=1e-8)
    if mps > 0.01:
        assert time_at(course, way_m, DELAYED) == pytest.approx(time_s, abs=1e-6)


@settings(deadline=None)
@given(v0=speeds, target=targets, periods=st.integers(1, 5), time_s=st.floats(0.0, 10.0))
def test_following_a_manoeuvre_for_a_period_leaves_the_same_course(
    v0: float, target: float, periods: int, time_s: float
) -> None:
    # The basis of the argument that an admissible action leaves an admissible one.
    course = with_manoeuvre(begin_course(v0, 0.0, target, NUMBERS), periods, NUMBERS)
    at_m, mps = way_at(course, 0.5, NUMBERS), speed_at(course, 0.5, NUMBERS)
    rest = with_manoeuvre(begin_course(mps, target, 5.0, NUMBERS), periods - 1, NUMBERS)
    expected_m = way_at(course, 0.5 + time_s, NUMBERS)
    assert at_m + way_at(rest, time_s, NUMBERS) == pytest.approx(expected_m, abs=1e-9)
