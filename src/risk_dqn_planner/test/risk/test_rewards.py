# SPDX-License-Identifier: Apache-2.0
"""Hand-computed values of every branch and limit of R_CSS and R_CSL (docs/paper.md)."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.risk.rewards import (
    gap_reward,
    leader_reward,
    leave_time,
    reach_time,
    safe_leave_reward,
    safe_stop_reward,
)
from risk_dqn_planner.situation.common_path import leader_gap


def stop_reward(ego_m: float, line_m: float, speed: float = 0.0, zone: float = 6.0) -> float:
    """R_CSS with a_brake 3.5 m/s^2 and d_safe = zone / 2 + 0.1."""
    reward: float = safe_stop_reward(ego_m, line_m, zone, speed, 3.5, 0.1)
    return reward


def test_at_rest_at_the_stop_line_is_fully_safe() -> None:
    assert stop_reward(ego_m=5.5, line_m=0.0) == 0.0


def test_behind_the_stop_line_the_reward_falls_quadratically() -> None:
    # d_stl = 5.5, d_safe = 3.1; at rest 4.3 before the zone's centre: -((4.3-5.5)/2.4)^2.
    assert stop_reward(ego_m=4.3, line_m=-1.2) == pytest.approx(-0.25)


def test_at_the_safe_distance_the_reward_has_fallen_to_its_least() -> None:
    assert stop_reward(ego_m=3.1 + 1e-9, line_m=-2.4) == pytest.approx(-1.0)
    assert stop_reward(ego_m=3.0999, line_m=-2.4001) == -1.0


def test_the_braking_distance_is_what_counts() -> None:
    # 3.5 m/s needs 1.75 m: it comes to rest at 7 - 1.75 = 5.25; d_stl = 5.5.
    expected = -(((5.25 - 5.5) / 2.4) ** 2)
    assert stop_reward(ego_m=7.0, line_m=1.5, speed=3.5) == pytest.approx(expected)
    assert stop_reward(ego_m=7.25, line_m=1.75, speed=3.5) == 0.0
    assert stop_reward(ego_m=4.8, line_m=-0.7, speed=3.5) == -1.0


def test_a_longer_zone_begins_earlier() -> None:
    assert stop_reward(ego_m=5.5, line_m=0.0, zone=10.9) == -1.0


@pytest.mark.parametrize("line_to_zone", [3.1, 2.0, 0.0, -1.0])
def test_a_stop_line_nearer_than_the_safe_distance_has_no_middle_branch(
    line_to_zone: float,
) -> None:
    for ego_m, expected in ((3.11, 0.0), (3.09, -1.0)):
        assert stop_reward(ego_m, line_m=ego_m - line_to_zone) == expected


def test_an_ego_behind_the_zone_cannot_stop_before_it() -> None:
    assert stop_reward(ego_m=-10.0, line_m=-15.5) == -1.0


def test_times_are_taken_to_the_zones_ends() -> None:
    # The other covers 9 - 3 = 6 m at 2 m/s^2; the ego 3 + 3 = 6 m at 1.5 m/s^2 from rest.
    assert reach_time(9.0, 6.0, 0.0, 2.0, 7.0) == pytest.approx(math.sqrt(6.0))
    assert leave_time(3.0, 6.0, 0.0, 1.5, 5.0) == pytest.approx(math.sqrt(8.0))


def test_the_speed_limit_bounds_the_others_and_top_speed_the_ego() -> None:
    # 7 m/s after 3.5 s and 12.25 m, 34.75 m left: 4.9643 s.
    assert reach_time(50.0, 6.0, 0.0, 2.0, 7.0) == pytest.approx(3.5 + 34.75 / 7.0)
    assert leave_time(17.0, 6.0, 0.0, 1.5, 5.0) == pytest.approx(5.6666667)


@pytest.mark.parametrize(
    ("gap_s", "expected"),
    [
        (4.0, 0.0),
        (3.0, 0.0),
        (1.55, -0.25),  # half way between 0.1 and 3
        (0.1, -1.0),
        (0.0999, -1.0),
        (-2.0, -1.0),
        (math.inf, 0.0),
    ],
)
def test_the_gap_is_rated_between_its_thresholds(gap_s: float, expected: float) -> None:
    assert gap_reward(gap_s, 3.0, 0.1) == pytest.approx(expected)


def test_an_ego_that_has_left_is_safe_even_with_a_vehicle_in_the_zone() -> None:
    assert leave_time(-3.0, 6.0, 0.0, 1.5, 5.0) == 0.0
    assert safe_leave_reward(0.0, 0.0, 3.0, 0.1) == 0.0


def test_a_vehicle_inside_the_zone_is_fully_unsafe() -> None:
    assert reach_time(2.9, 6.0, 5.0, 2.0, 7.0) == 0.0
    assert safe_leave_reward(0.0, 1e-6, 3.0, 0.1) == -1.0


def test_the_printed_sign_of_the_gap_rates_danger_as_safe() -> None:
    # A vehicle 1 s away, an ego that needs 5 s: the paper's prose says fully unsafe, and its
    # equation, t_leave - t_reach, would say fully safe; and the other way round.
    reach_s, leave_s = 1.0, 5.0
    assert safe_leave_reward(reach_s, leave_s, 3.0, 0.1) == -1.0
    assert gap_reward(leave_s - reach_s, 3.0, 0.1) == 0.0
    assert safe_leave_reward(leave_s, reach_s, 3.0, 0.1) == 0.0
    assert gap_reward(reach_s - leave_s, 3.0, 0.1) == -1.0


def test_a_vehicle_that_is_gone_is_safe_however_long_the_ego_takes() -> None:
    for leave_s in (0.0, 3.0, 1e6):
        assert safe_leave_reward(math.inf, leave_s, 3.0, 0.1) == 0.0


def test_at_top_speed_from_the_start_times_are_way_over_speed() -> None:
    # 5 + 3 = 8 m at 5 m/s; 38 - 3 = 35 m at 7 m/s.
    assert leave_time(5.0, 6.0, 5.0, 1.5, 5.0) == pytest.approx(1.6)
    assert reach_time(38.0, 6.0, 7.0, 2.0, 7.0) == pytest.approx(5.0)


def test_top_speed_that_is_reached_just_at_the_zone_leaves_both_formulas_equal() -> None:
    # From 3 to 7 m/s at 2 m/s^2 takes 2 s and 10 m: the zone begins there, at 13 m to its centre.
    assert reach_time(13.0, 6.0, 3.0, 2.0, 7.0) == pytest.approx(2.0)
    assert reach_time(13.0, 6.0, 3.0, 2.0, 7.0) == reach_time(13.0, 6.0, 3.0, 2.0, 100.0)
    # One metre further is driven at 7 m/s.
    assert reach_time(14.0, 6.0, 3.0, 2.0, 7.0) == pytest.approx(2.0 + 1.0 / 7.0)


def test_at_the_exact_thresholds_the_better_branch_counts() -> None:
    # At rest at d_safe = 3.1 m with the line at 5.5 m: the middle branch has come down to -1.
    assert stop_reward(ego_m=3.1, line_m=-2.4) == pytest.approx(-1.0)
    # A line at exactly d_safe: whoever rests there rests at the line.
    assert stop_reward(ego_m=3.1, line_m=0.0) == 0.0
    # The quadratic of R_CSL meets both of its neighbours.
    assert gap_reward(0.1, 3.0, 0.1) == -1.0
    assert gap_reward(3.0 - 1e-9, 3.0, 0.1) == pytest.approx(0.0, abs=1e-15)


def printed_gap(ego_m: float, other_m: float) -> float:
    """t_gap as the paper prints it: from rest, no top speeds, l = 6 m."""
    leave_s = math.sqrt(2.0 * (ego_m + 3.0) / 1.5)
    reach_s = math.sqrt(2.0 * (other_m - 3.0) / 2.0)
    return leave_s - reach_s


def read_gap(ego_m: float, other_m: float) -> float:
    """t_gap as the paper's prose and thresholds have it, from the project's own functions."""
    reach_s: float = reach_time(other_m, 6.0, 0.0, 2.0, 1e3)
    leave_s: float = leave_time(ego_m, 6.0, 0.0, 1.5, 1e3)
    return reach_s - leave_s


def test_as_printed_a_dangerous_gap_ranks_above_a_safe_one() -> None:
    # The ego, 15 m off, needs 4.90 s to leave. A vehicle 0.5 m before the zone is there in 0.71 s,
    # one 97 m before it in 9.85 s.
    dangerous, safe = (15.0, 3.5), (15.0, 100.0)
    assert printed_gap(*dangerous) == pytest.approx(4.1919, abs=1e-4)
    assert printed_gap(*safe) == pytest.approx(-4.9499, abs=1e-4)
    # "If t_gap > t_des the ego vehicle can safely leave before the other vehicle can reach it":
    # the printed equation says so of the vehicle that is there four seconds before the ego has
    # left, and calls fully unsafe (t_gap < t_safe) the one that comes five seconds after.
    assert gap_reward(printed_gap(*dangerous), 3.0, 0.1) == 0.0
    assert gap_reward(printed_gap(*safe), 3.0, 0.1) == -1.0
    assert gap_reward(read_gap(*dangerous), 3.0, 0.1) == -1.0
    assert gap_reward(read_gap(*safe), 3.0, 0.1) == 0.0


@given(st.floats(-2.0, 40.0), st.floats(3.0, 100.0), st.floats(0.1, 50.0))
def test_as_printed_a_vehicle_that_is_further_away_is_never_safer(
    ego_m: float, other_m: float, further_m: float
) -> None:
    printed = [gap_reward(printed_gap(ego_m, d), 3.0, 0.1) for d in (other_m, other_m + further_m)]
    read = [gap_reward(read_gap(ego_m, d), 3.0, 0.1) for d in (other_m, other_m + further_m)]
    assert printed[1] <= printed[0]
    assert read[1] >= read[0]
    assert read_gap(ego_m, other_m) == pytest.approx(-printed_gap(ego_m, other_m), abs=1e-9)


@given(st.floats(-20.0, 60.0), st.floats(-25.0, 60.0), st.floats(0.0, 5.0))
def test_stopping_earlier_is_never_worse(ego_m: float, line_m: float, speed: float) -> None:
    reward = stop_reward(ego_m, line_m, speed)
    assert -1.0 <= reward <= 0.0
    # Half a metre earlier on the same road: both distances grow.
    assert stop_reward(ego_m + 0.5, line_m + 0.5, speed) >= reward - 1e-9


@given(st.floats(0.0, 60.0), st.floats(0.0, 60.0), st.floats(0.0, 5.0))
def test_a_later_vehicle_is_never_worse(reach_s: float, leave_s: float, later_s: float) -> None:
    reward = safe_leave_reward(reach_s, leave_s, 3.0, 0.1)
    assert -1.0 <= reward <= 0.0
    assert safe_leave_reward(reach_s + later_s, leave_s, 3.0, 0.1) >= reward


def test_a_leader_is_as_far_ahead_as_both_are_from_the_join() -> None:
    # The zones (20 m for the ego, 16 m for the lane) end at the join. The ego's centre is 4 m
    # before its zone's centre, so 14 m before the join; the vehicle is 11 m past its zone's
    # centre, so 3 m past the join: 17 m ahead.
    assert leader_gap(4.0, 20.0, -11.0, 16.0) == pytest.approx(17.0)


@pytest.mark.parametrize(
    ("gap_m", "ego_mps", "leader_mps", "expected"),
    [
        (5.0, 5.0, 5.0, 0.0),  # both come to rest 5 m apart
        (4.99, 5.0, 5.0, -1.0),
        (8.58, 5.0, 0.0, 0.0),  # the ego needs 25 / 7 = 3.5714 m
        (8.57, 5.0, 0.0, -1.0),
        (4.99, 1.0, 7.0, -1.0),  # too near now, however fast it draws away
        (5.01, 1.0, 7.0, 0.0),
        (0.0, 5.0, 7.0, 0.0),  # beside or behind: a follower, no leader
        (-6.0, 5.0, 7.0, 0.0),
    ],
)
def test_the_ego_must_come_to_rest_behind_a_leader_that_brakes_as_hard(
    gap_m: float, ego_mps: float, leader_mps: float, expected: float
) -> None:
    assert leader_reward(gap_m, ego_mps, leader_mps, 3.5, 5.0) == expected
