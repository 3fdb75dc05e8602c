# SPDX-License-Identifier: Apache-2.0
"""Long vehicles count by the nearer end. Lane 1 runs north, its zone is 6 m about the origin."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from risk_dqn_planner.intersection.model import ConflictKind
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.joint_check import joint_check
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.inputs import EgoPose, object_arrays
from risk_dqn_planner.situation.long_vehicles import fronts_to_join, nearest_ends
from risk_dqn_planner.situation.situations import Booleans
from risk_dqn_planner.situation.warm_up import crossing_model, square

CROSSING = crossing_model()
# The ego's zone is s = 57 to 63 m, and what has joined is where the ego's zone ends.
MERGING = replace(
    CROSSING,
    lanes=(replace(CROSSING.lanes[0], kind=ConflictKind.MERGING, ego_join_m=63.0),),
)


def counts_at(
    distance_m: float, length_m: float, ego_s: float = 0.0, merging: bool = False
) -> float:
    model = MERGING if merging else CROSSING
    lane, at_m, length = np.array([0]), np.array([distance_m]), np.array([length_m])
    return float(nearest_ends(model, ego_s, lane, at_m, length)[0])


@pytest.mark.parametrize(
    ("distance_m", "expected"),
    # 4 m longer to either end; in between it is in the zone.
    [(20.0, 16.0), (7.0, 3.0), (0.0, 0.0), (-3.5, -1.5), (-7.0, -3.0), (-9.0, -5.0)],
)
def test_before_a_crossing_zone_the_front_counts_and_past_it_the_rear(
    distance_m: float, expected: float
) -> None:
    assert counts_at(distance_m, 12.0) == pytest.approx(expected)


@pytest.mark.parametrize("length_m", [0.0, 2.5, 4.0])
def test_a_vehicle_that_is_short_or_of_unknown_length_is_where_its_centre_is(
    length_m: float,
) -> None:
    assert counts_at(17.3, length_m) == 17.3
    assert counts_at(17.3, length_m, merging=True) == 17.3


@given(st.floats(-80.0, 80.0), st.floats(4.0, 25.0))
def test_a_longer_vehicle_arrives_earlier_and_leaves_later(distance_m: float, more: float) -> None:
    now, longer = counts_at(distance_m, more), counts_at(distance_m, more + 1.0)
    assert longer <= now + 1e-9 if distance_m > 0.0 else longer >= now - 1e-9
    # It is in the zone for the check exactly if one of its ends, or what is between, is.
    half_m = 3.0 + 0.5 * (more - 4.0)
    if abs(abs(distance_m) - half_m) > 1e-6:
        assert (abs(now) < 3.0) == (abs(distance_m) < half_m)


@pytest.mark.parametrize(
    ("ego_s", "distance_m", "expected"),
    [
        # The ego is 10 m before the join; the vehicle's centre 5 m before it, then 10 m past it.
        (53.0, 2.0, 6.0),
        (53.0, -13.0, -9.0),
        # 20 m before the join and so 10 m behind the ego.
        (53.0, 17.0, 13.0),
        # Beside the ego: behind it by the front, unless that is a car's length ahead.
        (53.0, 7.0, 3.0),
        (53.0, 10.5, 6.5),
        (53.0, 6.0, 7.0),
    ],
)
def test_whoever_merges_is_ahead_by_its_rear_and_behind_by_its_front(
    ego_s: float, distance_m: float, expected: float
) -> None:
    assert counts_at(distance_m, 12.0, ego_s, merging=True) == pytest.approx(expected)


def front_at(distance_m: float, length_m: float = 12.0, ego_s: float = 53.0) -> float:
    at = np.array([0]), np.array([distance_m]), np.array([length_m])
    return float(fronts_to_join(MERGING, ego_s, *at)[0])


def test_the_front_of_a_lorry_ahead_that_has_not_joined_counts_as_a_hidden_vehicle() -> None:
    # Its front is 4 m before its centre, past the zone's end at -3 m it has joined.
    assert [front_at(distance_m) for distance_m in (6.0, 2.0, 1.1)] == pytest.approx([2, -2, -2.9])
    assert front_at(0.9) == math.inf
    # Behind the ego, or of usual length, it hides nothing.
    assert front_at(17.0) == front_at(2.0, length_m=4.0) == math.inf
    assert math.isinf(fronts_to_join(CROSSING, 0.0, *map(np.array, ([0], [6.0], [12.0])))[0])


def test_a_lorry_that_was_to_join_and_is_lost_from_sight_is_remembered_by_its_front() -> None:
    builder, ego = SituationBuilder(MERGING), EgoPose(-40.0, 0.0, 0.0, 4.0)
    lorry = object_arrays([[0.0, -12.0, math.pi / 2, 0.0]], size_m=(12.0, 2.0))
    nobody = object_arrays([], size_m=(12.0, 2.0))
    before = builder.build(ego, lorry, square(60.0), time_s=1.0)
    assert before.vehicle_distance_m[0, 0] == pytest.approx(16.0)
    assert before.lane_hidden_distance_m[0, 0] == pytest.approx(8.0)
    # It is missed after the area was taken, which therefore does not tell that nobody is there.
    after = builder.build(ego, nobody, square(60.0), visible_area_age_s=0.2, time_s=1.1)
    assert after.lane_hidden_distance_m[0, 0] < 8.0


def admissible(ego: EgoPose, y_m: float, mps: float, length_m: float) -> Booleans:
    row = object_arrays([[0.0, y_m, math.pi / 2, mps]], size_m=(length_m, 2.0))
    situation = SituationBuilder(MERGING).build(ego, row, square(60.0))
    return joint_check(situation, SafetyAssumptions()).admissible[0]


@settings(max_examples=300, deadline=None)
@given(
    ego_m=st.floats(-45.0, 3.0),
    ego_mps=st.floats(0.0, 8.0),
    y_m=st.floats(-50.0, 8.0),
    mps=st.floats(0.0, 10.0),
    length_m=st.floats(4.0, 16.0),
    share=st.floats(-1.0, 1.0),
)
@example(ego_m=-11.3, ego_mps=7.6, y_m=-9.4, mps=0.0, length_m=16.0, share=0.9)
def test_what_is_sound_beside_a_lorry_is_so_beside_a_car_in_any_part_of_it(
    ego_m: float, ego_mps: float, y_m: float, mps: float, length_m: float, share: float
) -> None:
    ego = EgoPose(ego_m, 0.0, 0.0, ego_mps)
    part_m = y_m + share * 0.5 * (length_m - 4.0)
    # Whose centre lies in the ego's footprint is the ego.
    assume(abs(ego_m) > 3.0 or min(abs(y_m), abs(part_m)) > 2.0)
    beside_lorry = admissible(ego, y_m, mps, length_m)
    beside_car = admissible(ego, part_m, mps, 4.0)
    assert not (beside_lorry & ~beside_car).any()


def test_the_ego_does_not_join_before_a_lorry_whose_rear_alone_is_far_enough_back() -> None:
    ego = EgoPose(-11.3, 0.0, 0.0, 7.6)
    # It stands with its ends where these two cars have theirs.
    assert [admissible(ego, y_m, 0.0, 4.0)[2] for y_m in (-15.8, -3.0)] == [True, False]
    assert not admissible(ego, -9.4, 0.0, 16.8)[2]


def test_a_lorry_is_nearer_to_its_zone_than_a_car_at_the_same_place() -> None:
    builder, ego = SituationBuilder(CROSSING), EgoPose(-20.0, 0.0, 0.0, 4.0)
    row = [0.0, -30.0, math.pi / 2, 5.0]
    car, lorry = (
        builder.build(ego, object_arrays([row], size_m=(length_m, 2.0)), square(40.0))
        for length_m in (4.0, 10.0)
    )
    assert car.vehicle_distance_m[0, 0] == pytest.approx(30.0)
    assert lorry.vehicle_distance_m[0, 0] == pytest.approx(27.0)
