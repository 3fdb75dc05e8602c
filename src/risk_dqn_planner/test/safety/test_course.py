# SPDX-License-Identifier: Apache-2.0
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.risk.motion import distance_after, speed_after, time_to_travel
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.course import (
    BRAKE,
    GO,
    begin_between,
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
    course = with_manoeuvre(begin_course(2.0, 0.0, 5.0, NUMBERS), BRAKE, NUMBERS).slowest
    assert course.rest_m == pytest.approx(2.26786, abs=1e-5)
    assert speed_at(course, 0.5) == pytest.approx(2.75)
    assert speed_at(course, 2.0) == 0.0
    assert way_at(course, 9.0) == pytest.approx(course.rest_m)
    assert time_at(course, 2.3) == math.inf


def test_slowing_lasts_until_the_target_is_reached() -> None:
    # From 2 to 1 m/s takes 2/7 s of the period.
    course = begin_course(2.0, 0.0, 1.0, NUMBERS).slowest
    assert course.slowing_until_s == pytest.approx(2.0 / 7.0)
    assert begin_course(2.0, 0.0, 5.0, NUMBERS).slowest.slowing_until_s == 0.0
    # During a delay in which Stop is in force the ego slows down too.
    assert begin_course(2.0, 0.0, 5.0, DELAYED).slowest.slowing_until_s == pytest.approx(0.3)


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
    course = with_manoeuvre(begin_course(v0, in_force, target, DELAYED), periods, DELAYED).slowest
    way_m, mps = way_at(course, time_s), speed_at(course, time_s)
    assert 0.0 <= mps <= 5.0 + 1e-9
    assert way_m <= course.rest_m + 1e-9
    step_s = 1e-6
    ahead_m = way_at(course, time_s + step_s)
    assert ahead_m - way_m == pytest.approx(mps * step_s, abs=1e-8)
    if mps > 0.01:
        assert time_at(course, way_m) == pytest.approx(time_s, abs=1e-6)


@settings(deadline=None)
@given(v0=speeds, target=targets, periods=st.integers(1, 5), time_s=st.floats(0.0, 10.0))
def test_following_a_manoeuvre_for_a_period_leaves_the_same_course(
    v0: float, target: float, periods: int, time_s: float
) -> None:
    # The basis of the argument that an admissible action leaves an admissible one.
    course = with_manoeuvre(begin_course(v0, 0.0, target, NUMBERS), periods, NUMBERS).slowest
    at_m, mps = way_at(course, 0.5), speed_at(course, 0.5)
    rest = with_manoeuvre(begin_course(mps, target, 5.0, NUMBERS), periods - 1, NUMBERS).slowest
    expected_m = way_at(course, 0.5 + time_s)
    assert at_m + way_at(rest, time_s) == pytest.approx(expected_m, abs=1e-9)


RANGED = SafetyAssumptions(
    actuation_delay_s=0.4,
    actuation_jitter_s=0.3,
    ego_acceleration_factor=1.7,
    ego_braking_factor=1.4,
).numbers()


@settings(deadline=None)
@given(
    v0=speeds,
    in_force=targets,
    target=targets,
    periods=st.sampled_from([BRAKE, 1, 3, GO]),
    delays=st.lists(st.floats(0.1, 0.4), min_size=12, max_size=12),
    hard=st.lists(st.floats(0.0, 1.0), min_size=100, max_size=100),
)
def test_the_ego_stays_between_the_motions_of_its_course(
    v0: float,
    in_force: float,
    target: float,
    periods: int,
    delays: list[float],
    hard: list[float],
) -> None:
    course = with_manoeuvre(begin_course(v0, in_force, target, RANGED), periods, RANGED)
    # What is decided from now on, each decision with its own delay; rates change all the time.
    decided = [target] + [5.0] * min(periods, 10) + [0.0] * (11 - min(periods, 10))
    step_s, way_m, mps = 0.05, 0.0, v0
    for k, share in enumerate(hard):
        time_s = step_s * k
        heads_for = in_force
        for number, delay_s in enumerate(delays):
            if time_s >= 0.5 * number + delay_s:
                heads_for = decided[number]
        up, down = 1.5 * (1.0 + 0.7 * share), 3.5 * (1.0 + 0.4 * share)
        # Delays are rounded up to steps, which may be a step beyond the longest.
        slack_m, slack_mps = step_s * 5.0, step_s * 4.9
        assert way_m <= way_at(course.fastest, time_s) + slack_m
        assert mps <= speed_at(course.fastest, time_s) + slack_mps
        assert way_m >= way_at(course.slowest, time_s) - slack_m
        assert mps >= speed_at(course.slowest, time_s) - slack_mps
        way_m += float(distance_after(step_s, mps, heads_for, up, down))
        mps = float(speed_after(step_s, mps, heads_for, up, down))


@settings(deadline=None)
@given(v0=speeds, in_force=targets, target=targets, periods=st.sampled_from([BRAKE, 1, 3, GO]))
def test_a_range_of_nothing_leaves_one_motion(
    v0: float, in_force: float, target: float, periods: int
) -> None:
    course = with_manoeuvre(begin_course(v0, in_force, target, DELAYED), periods, DELAYED)
    assert course.exact
    assert course.fastest == course.slowest
    unknown = begin_between(v0, 0.0, 5.0, target, DELAYED)
    for known in (0.0, 1.0, 5.0):
        course = begin_course(v0, known, target, DELAYED)
        assert unknown.slowest.m2 <= course.slowest.m2 + 1e-12
        assert unknown.fastest.m2 >= course.fastest.m2 - 1e-12
