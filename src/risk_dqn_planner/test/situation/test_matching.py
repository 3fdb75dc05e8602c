# SPDX-License-Identifier: Apache-2.0
"""Which vehicles are on which lanes. Lane 1 runs north through the origin, 3.5 m wide."""

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import (
    ConflictKind,
    ConflictPath,
    IntersectionModel,
    LanePath,
)
from risk_dqn_planner.situation.inputs import ObjectArrays, object_arrays
from risk_dqn_planner.situation.matching import match_kernel
from risk_dqn_planner.situation.paths import path_table
from risk_dqn_planner.situation.warm_up import crossing_model

NORTH = math.pi / 2
SIXTY = math.radians(60.0)


# Object index, lane index, distance and speed; Any lets pytest.approx stand for a number.
Match = tuple[int, int, Any, Any]


def match(model: IntersectionModel, objects: ObjectArrays) -> list[Match]:
    who, lane, distance, speed = match_kernel(path_table(model), objects, 0.3, SIXTY, 4.0, 0.0)
    return list(zip(who.tolist(), lane.tolist(), distance.tolist(), speed.tolist(), strict=True))


def distances(*rows: list[float]) -> list[float]:
    return [d for _, _, d, _ in match(crossing_model(), object_arrays(rows))]


def test_an_oncoming_vehicle_is_not_on_the_lane() -> None:
    assert distances([0.0, -20.0, -NORTH, 5.0]) == []


def test_a_crossing_vehicle_is_not_on_the_lane() -> None:
    assert distances([0.0, -20.0, 0.0, 5.0]) == []


def test_a_vehicle_turned_by_59_degrees_is_on_the_lane_and_by_61_is_not() -> None:
    assert distances([0.0, -20.0, NORTH + math.radians(59.0), 5.0]) == pytest.approx([20.0])
    assert distances([0.0, -20.0, NORTH + math.radians(61.0), 5.0]) == []


def test_headings_may_be_given_with_full_turns() -> None:
    assert distances([0.0, -20.0, NORTH + 6.0 * math.pi, 5.0]) == pytest.approx([20.0])


@pytest.mark.parametrize(("x", "on_lane"), [(2.04, True), (-2.04, True), (2.06, False)])
def test_the_lane_reaches_to_half_its_width_plus_the_tolerance(x: float, on_lane: bool) -> None:
    assert len(distances([x, -20.0, NORTH, 5.0])) == int(on_lane)


@pytest.mark.parametrize(("y", "on_lane"), [(2.9, True), (3.1, False)])
def test_a_crossing_vehicle_counts_until_its_centre_has_left_the_zone(
    y: float, on_lane: bool
) -> None:
    assert distances([0.0, y, NORTH, 5.0]) == pytest.approx([-y] if on_lane else [])


def test_a_vehicle_before_the_lanes_start_is_not_on_it() -> None:
    assert distances([0.0, -70.1, NORTH, 5.0]) == []
    assert distances([0.0, -69.9, NORTH, 5.0]) == pytest.approx([69.9])


def test_a_reversing_vehicle_moves_against_the_lane() -> None:
    assert match(crossing_model(), object_arrays([[0.0, -20.0, NORTH, -2.0]])) == [
        (0, 0, pytest.approx(20.0), pytest.approx(-2.0))
    ]


def test_what_is_not_a_number_is_on_no_lane() -> None:
    assert distances([math.nan, -20.0, NORTH, 5.0], [0.0, -20.0, math.nan, 5.0]) == []


def with_paths(*lines: list[list[float]]) -> IntersectionModel:
    """Give lane 1 of the crossing several ways through the zone, each ending at (0, 30)."""
    model = crossing_model()
    paths = []
    for points in lines:
        line = Polyline.from_points(points)
        path = LanePath((1,), (0.0,), line, 1.75)
        paths.append(ConflictPath(path, line.length_m - 30.0, math.inf))
    return replace(model, lanes=(replace(model.lanes[0], paths=tuple(paths)),))


def test_a_vehicle_on_the_part_that_two_branches_share_counts_once() -> None:
    model = with_paths(
        [[-30.0, -40.0], [0.0, -10.0], [0.0, 30.0]], [[30.0, -40.0], [0.0, -10.0], [0.0, 30.0]]
    )
    assert match(model, object_arrays([[0.0, -5.0, NORTH, 5.0]])) == [
        (0, 0, pytest.approx(5.0), pytest.approx(5.0))
    ]


def test_a_vehicle_that_fits_two_branches_takes_the_shorter_way() -> None:
    model = with_paths(
        [[0.0, -40.0], [0.0, 30.0]], [[1.0, -40.0], [1.0, -20.0], [0.0, -10.0], [0.0, 30.0]]
    )
    forward = match(model, object_arrays([[0.5, -30.0, NORTH, 5.0]]))
    lane = model.lanes[0]
    swapped = replace(model, lanes=(replace(lane, paths=lane.paths[::-1]),))
    assert forward == [(0, 0, pytest.approx(30.0), pytest.approx(5.0))]
    assert match(swapped, object_arrays([[0.5, -30.0, NORTH, 5.0]])) == forward


def test_on_a_lane_that_passes_one_place_twice_the_heading_tells_which_time() -> None:
    # North, back south 1 m beside, north again: an S of hairpins.
    model = with_paths([[0.0, -40.0], [0.0, -10.0], [1.0, -10.0], [1.0, -40.0], [2.0, -40.0],
                        [2.0, -10.0], [0.0, -5.0], [0.0, 30.0]])  # fmt: skip
    (_, _, north, _), (_, _, south, _) = match(
        model, object_arrays([[0.4, -20.0, NORTH, 5.0], [0.4, -20.0, -NORTH, 5.0]])
    )
    # Between the two passes lie 10 m north, 1 m across and 10 m south.
    assert north - south == pytest.approx(21.0)


def merging_model() -> IntersectionModel:
    """A lane from the south joins the ego's lane at the origin; the ego's goal is 20 m on.

    Leaders matter for 10 m more.
    """
    model = crossing_model()
    line = Polyline.from_points([[-30.0, -30.0], [0.0, 0.0], [40.0, 0.0]])
    join = math.hypot(30.0, 30.0)
    path = ConflictPath(LanePath((1, 11), (0.0, join), line, 1.75), join - 5.0, join)
    lane = replace(
        model.lanes[0],
        kind=ConflictKind.MERGING,
        ego_zone_center_m=55.0,
        zone_length_m=10.0,
        ego_zone_length_m=10.0,
        ego_join_m=60.0,
        paths=(path,),
    )
    return replace(model, lanes=(lane,))


@pytest.mark.parametrize(("x", "expected"), [(15.0, [-20.0]), (29.9, [-34.9]), (30.1, [])])
def test_a_vehicle_that_has_merged_counts_until_past_the_goal(
    x: float, expected: list[float]
) -> None:
    matched = match(merging_model(), object_arrays([[x, 0.0, 0.0, 5.0]]))
    assert [d for _, _, d, _ in matched] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("y", "length_m", "position_error_m", "counts"),
    [
        (3.1, 4.0, 0.0, False),
        (3.4, 4.0, 0.5, True),
        (3.6, 4.0, 0.5, False),
        (6.9, 12.0, 0.0, True),
        (7.1, 12.0, 0.0, False),
        (7.4, 12.0, 0.5, True),
    ],
)
def test_a_vehicle_counts_until_its_rear_has_left_the_zone_for_certain(
    y: float, length_m: float, position_error_m: float, counts: bool
) -> None:
    objects = object_arrays([[0.0, y, NORTH, 5.0]], size_m=(length_m, 2.0))
    table = path_table(crossing_model())
    who, *_ = match_kernel(table, objects, 0.3, SIXTY, 4.0, position_error_m)
    assert len(who) == int(counts)


def test_one_vehicle_can_be_on_several_lanes() -> None:
    model = crossing_model()
    other = replace(model.lanes[0], lane_id=2)
    both = replace(model, lanes=(model.lanes[0], other))
    matched = match(both, object_arrays([[0.0, -20.0, NORTH, 5.0], [0.0, -9.0, NORTH, 5.0]]))
    assert [(who, lane) for who, lane, _, _ in matched] == [(0, 0), (0, 1), (1, 0), (1, 1)]


@settings(max_examples=100, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.floats(-5.0, 5.0), st.floats(-80.0, 40.0), st.floats(-4.0, 4.0), st.floats(0.0, 20.0)
        ),
        max_size=8,
    )
)
def test_every_vehicle_is_matched_as_if_it_were_alone(rows: list[tuple[float, ...]]) -> None:
    model = crossing_model()
    together = match(model, object_arrays(rows))
    alone = [
        (k, *rest) for k, row in enumerate(rows) for _, *rest in match(model, object_arrays([row]))
    ]
    assert together == alone
