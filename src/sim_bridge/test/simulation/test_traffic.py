# SPDX-License-Identifier: Apache-2.0
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_bridge.scenarios.fields import CarFollowing
from sim_bridge.simulation.settings import idm_of
from sim_bridge.simulation.traffic import accepts_ego, idm_acceleration, yields_now

# a = 1.5, b = 2, T = 1.2, s0 = 2, strongest braking 8.
IDM = idm_of(CarFollowing())


def test_on_a_free_road_only_the_desired_speed_counts():
    assert idm_acceleration(0.0, 6.0, math.inf, 0.0, IDM) == 1.5
    assert idm_acceleration(6.0, 6.0, math.inf, 0.0, IDM) == 0.0
    # 1.5 (1 - (3/6)^4)
    assert idm_acceleration(3.0, 6.0, math.inf, 0.0, IDM) == pytest.approx(1.40625)


def test_the_model_gives_the_hand_computed_acceleration_behind_a_leader():
    # s* = 2 + 5 * 1.2 + 5 * (5 - 3) / (2 sqrt(3)) = 10.8868; ratio to a gap of 20 m: 0.54434
    # 1.5 (1 - (5/7)^4 - 0.54434^2)
    wanted = 2.0 + 6.0 + 10.0 / (2.0 * math.sqrt(3.0))
    expected = 1.5 * (1.0 - (5.0 / 7.0) ** 4 - (wanted / 20.0) ** 2)
    assert expected == pytest.approx(0.6651, abs=1e-4)
    assert idm_acceleration(5.0, 7.0, 20.0, 3.0, IDM) == pytest.approx(expected)


def test_a_faster_leader_never_makes_the_wanted_gap_less_than_the_standstill_gap():
    # The closing term is -17 m here; s* stays 2 m.
    assert idm_acceleration(1.0, 7.0, 4.0, 50.0, IDM) == pytest.approx(1.5 * (1.0 - 7.0**-4 - 0.25))


def test_braking_is_limited():
    assert idm_acceleration(7.0, 7.0, 0.1, 0.0, IDM) == -8.0
    assert idm_acceleration(7.0, 7.0, -3.0, 0.0, IDM) == -8.0


@given(st.floats(0.0, 7.0), st.floats(3.5, 7.0), st.floats(0.1, 200.0), st.floats(0.0, 7.0))
def test_acceleration_stays_between_the_strongest_braking_and_that_of_the_free_road(
    speed: float, desired: float, gap: float, leader: float
):
    assert -8.0 <= idm_acceleration(speed, desired, gap, leader, IDM) <= 1.5


@given(st.floats(0.0, 7.0), st.floats(3.5, 7.0), st.floats(0.1, 200.0), st.floats(0.0, 7.0))
def test_a_wider_gap_never_makes_a_driver_brake_harder(
    speed: float, desired: float, gap: float, leader: float
):
    near = idm_acceleration(speed, desired, gap, leader, IDM)
    assert idm_acceleration(speed, desired, gap * 1.5, leader, IDM) >= near


def test_the_ego_is_accepted_as_leader_if_comfortable_braking_keeps_the_standstill_gap():
    # Closing at 4 m/s takes 4^2 / (2 * 2) = 4 m, and 2 m are to stay.
    assert accepts_ego(6.0, 7.0, 3.0, IDM)
    assert not accepts_ego(5.99, 7.0, 3.0, IDM)
    # Not closing in: the standstill gap is enough.
    assert accepts_ego(2.0, 3.0, 5.0, IDM)
    assert not accepts_ego(1.99, 3.0, 5.0, IDM)


@pytest.mark.parametrize(
    ("gap", "speed", "ego_distance", "ego_speed", "yields"),
    [
        (10.0, 5.0, 10.0, 4.0, True),  # the ego comes
        (10.0, 5.0, 10.0, 0.0, False),  # the ego stands before the zone: go
        (10.0, 5.0, 18.1, 4.0, False),  # still further than 3 + 15 m
        (10.0, 5.0, 0.0, 0.0, True),  # the ego stands in the zone
        (10.0, 5.0, -3.1, 4.0, False),  # the ego has left
        (0.0, 5.0, 10.0, 4.0, False),  # the vehicle is already inside
        (4.0, 5.0, 10.0, 4.0, False),  # 25 / (2 * 1.5 * 2) = 4.17 m to stop
        (4.2, 5.0, 10.0, 4.0, True),
    ],
)
def test_a_yielding_vehicle_waits_for_an_ego_that_comes_or_stands_in_its_zone(
    gap: float, speed: float, ego_distance: float, ego_speed: float, yields: bool
):
    assert yields_now(gap, speed, ego_distance, 3.0, ego_speed, IDM) == yields
