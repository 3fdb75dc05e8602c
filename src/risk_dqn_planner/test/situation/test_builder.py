# SPDX-License-Identifier: Apache-2.0
"""Hand-computed situations on the crossing at the origin (ego east, lane 1 north)."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from risk_dqn_planner.errors import EgoPoseError, InputError
from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import IntersectionModel, LanePath
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.inputs import EgoPose, object_arrays
from risk_dqn_planner.situation.situations import Floats, Situations
from risk_dqn_planner.situation.warm_up import crossing_model, example_situation, square

NORTH = math.pi / 2
EGO = EgoPose(-20.0, 0.5, 0.1, 4.0)


def build(
    rows: ArrayLike, ids: ArrayLike | None = None, ego: EgoPose = EGO, area: ArrayLike | None = None
) -> Situations:
    polygon = square(100.0) if area is None else np.asarray(area, dtype=np.float64)
    return SituationBuilder(crossing_model()).build(ego, object_arrays(rows, ids), polygon)


def test_ego_distances_are_measured_along_its_path() -> None:
    situations = build([])
    assert situations.stop_line_distance_m == pytest.approx([14.0])
    assert situations.goal_distance_m == pytest.approx([40.0])
    assert situations.ego_speed_mps == pytest.approx([4.0])
    assert situations.lane_ego_distance_m == pytest.approx(np.array([[20.0]]))


def test_lane_attributes_come_from_the_model() -> None:
    situations = build([])
    assert situations.lane_id.tolist() == [[1]]
    assert situations.lane_mask.tolist() == [[True]]
    assert situations.lane_merging.tolist() == [[False]]
    assert situations.lane_speed_limit_mps.tolist() == [[7.0]]
    assert situations.lane_zone_m.tolist() == [[6.0]]
    assert situations.lane_ego_zone_m.tolist() == [[6.0]]


def test_a_vehicle_on_the_lane_has_its_distance_to_the_zone_and_its_speed_along_the_lane() -> None:
    situations = build([[0.5, -25.0, NORTH + 0.2, 6.0]], ids=[17])
    assert situations.vehicle_mask.tolist() == [[True]]
    assert situations.vehicle_id.tolist() == [[17]]
    assert situations.vehicle_lane.tolist() == [[0]]
    assert situations.vehicle_distance_m == pytest.approx(np.array([[25.0]]))
    assert situations.vehicle_speed_mps == pytest.approx(np.array([[6.0 * math.cos(0.2)]]))


def test_vehicles_are_ordered_by_id_whatever_the_order_of_the_message() -> None:
    rows = [[0.0, -10.0, NORTH, 5.0], [0.0, -30.0, NORTH, 5.0], [0.0, -50.0, NORTH, 5.0]]
    situations = build(rows, ids=[9, 2, 5])
    assert situations.vehicle_id.tolist() == [[2, 5, 9]]
    assert situations.vehicle_distance_m == pytest.approx(np.array([[30.0, 50.0, 10.0]]))


def test_without_vehicles_one_place_stays_empty() -> None:
    assert build([]).vehicle_mask.tolist() == [[False]]


def test_the_ego_is_not_its_own_traffic() -> None:
    # The ego stands in the crossing and faces lane 1's direction closely enough to fit it.
    turned = math.radians(50.0)
    ego = EgoPose(0.0, 0.0, turned, 3.0)
    own = [0.3, 0.2, turned, 3.0]
    real = [0.0, -6.0, NORTH, 3.0]
    assert build([own, real], ids=[1, 2], ego=ego).vehicle_id.tolist() == [[2]]


@pytest.mark.parametrize(
    ("ego", "sentence"),
    [
        (EgoPose(-20.0, 2.5, 0.0, 5.0), r"2\.5 m beside its route, expected at most 2 m"),
        (EgoPose(-20.0, 0.0, math.radians(-70.0), 5.0), "turned 70 degrees away"),
        (EgoPose(-20.0, 0.0, math.pi, 5.0), "turned 180 degrees away"),
        (EgoPose(-63.0, 0.0, 0.0, 5.0), r"3\.0 m before the start of its route"),
        (EgoPose(41.5, 0.0, 0.0, 5.0), r"1\.5 m beyond the end of its route"),
    ],
)
def test_an_ego_off_its_route_is_refused_with_numbers(ego: EgoPose, sentence: str) -> None:
    with pytest.raises(EgoPoseError, match=sentence):
        build([], ego=ego)


@pytest.mark.parametrize(
    ("rows", "ids", "sentence"),
    [
        ([[0.0, math.nan, 0.0, 1.0]], [7], "object 7: y_m is nan, expected a finite number"),
        ([[math.inf, 0.0, 0.0, 1.0]], [7], "object 7: x_m is inf"),
        ([[0.0, 0.0, 0.0, 5.0], [1.0, 0.0, 0.0, 500.0]], [1, 8], "object 8: speed_mps is 500"),
        ([[0.0, 0.0, 0.0, 1.0], [0.0, 9.0, 0.0, 1.0]], [4, 4], "id 4 appears 2 times"),
    ],
)
def test_a_broken_object_is_named(rows: ArrayLike, ids: ArrayLike, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        build(rows, ids)


def test_a_negative_footprint_is_refused() -> None:
    objects = object_arrays([[0.0, -9.0, NORTH, 1.0]], size_m=(-4.0, 2.0))
    with pytest.raises(InputError, match="object 1: length_m is -4, expected 0 or more"):
        SituationBuilder(crossing_model()).build(EGO, objects, square(9.0))


@pytest.mark.parametrize(
    ("area", "sentence"),
    [
        ([[0.0, 0.0], [1.0, 1.0]], "2 points, expected at least 3"),
        (np.zeros((0, 2)), "0 points"),
        ([[0.0, 0.0], [1.0, math.nan], [1.0, 1.0]], "point 1 is"),
    ],
)
def test_a_broken_visible_area_is_refused(area: ArrayLike, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        build([], area=area)


def test_an_ego_that_is_not_a_number_is_refused() -> None:
    with pytest.raises(InputError, match="ego: speed_mps is nan"):
        build([], ego=EgoPose(0.0, 0.0, 0.0, math.nan))


def test_the_example_for_warming_up_is_what_it_says() -> None:
    situations = example_situation()
    assert situations.vehicle_distance_m == pytest.approx(np.array([[30.0]]))
    assert situations.lane_hidden_distance_m == pytest.approx(np.array([[40.0]]))


def moved_points(points: Floats, turn: float, shift: tuple[float, float]) -> Floats:
    cosine, sine = math.cos(turn), math.sin(turn)
    moved: Floats = points @ np.array([[cosine, sine], [-sine, cosine]]) + shift
    return moved


def moved_lane(lane: LanePath, turn: float, shift: tuple[float, float]) -> LanePath:
    line = Polyline.from_points(moved_points(lane.centerline.xy, turn, shift))
    return replace(lane, centerline=line)


def moved_model(turn: float, shift: tuple[float, float]) -> IntersectionModel:
    model = crossing_model()
    lane = model.lanes[0]
    path = replace(lane.paths[0], path=moved_lane(lane.paths[0].path, turn, shift))
    return replace(
        model,
        ego_path=moved_lane(model.ego_path, turn, shift),
        lanes=(replace(lane, paths=(path,)),),
    )


@settings(max_examples=60, deadline=None)
@given(
    turn=st.floats(-math.pi, math.pi),
    shift=st.tuples(st.floats(-1000.0, 1000.0), st.floats(-1000.0, 1000.0)),
    along=st.floats(5.0, 60.0),
    seen=st.floats(4.0, 60.0),
)
def test_moving_or_turning_the_whole_map_changes_nothing(
    turn: float, shift: tuple[float, float], along: float, seen: float
) -> None:
    rows = np.array([[0.4, -along, NORTH, 5.0], [3.0, -12.0, NORTH, 5.0]])
    moved_rows = rows.copy()
    moved_rows[:, :2] = moved_points(rows[:, :2], turn, shift)
    moved_rows[:, 2] += turn
    x, y = moved_points(np.array([[EGO.x_m, EGO.y_m]]), turn, shift)[0]
    ego = EgoPose(x, y, EGO.heading_rad + turn, EGO.speed_mps)
    area = np.array([[-80.0, -seen], [90.0, -seen], [90.0, 50.0], [-80.0, 50.0]])
    expected = build(rows, area=area)
    got = SituationBuilder(moved_model(turn, shift)).build(
        ego, object_arrays(moved_rows), moved_points(area, turn, shift)
    )
    assert expected.lane_hidden_distance_m == pytest.approx(np.array([[seen]]))
    for name, before, after in zip(expected._fields, expected, got, strict=True):
        assert after == pytest.approx(before, abs=1e-6), name


ANY_FLOAT = st.floats(allow_nan=True, allow_infinity=True)
NEAR = st.floats(-80.0, 80.0)


@settings(max_examples=300, deadline=None)
@given(
    ego=st.tuples(ANY_FLOAT | NEAR, ANY_FLOAT | NEAR, ANY_FLOAT | st.just(0.0), ANY_FLOAT | NEAR),
    rows=st.lists(st.tuples(*[ANY_FLOAT | NEAR] * 4), max_size=4),
    corners=st.lists(st.tuples(ANY_FLOAT | NEAR, ANY_FLOAT | NEAR), max_size=6),
)
def test_whatever_comes_in_the_situation_is_finite_or_a_named_error_says_why(
    ego: tuple[float, float, float, float],
    rows: list[tuple[float, ...]],
    corners: list[tuple[float, float]],
) -> None:
    area = np.array(corners, dtype=np.float64).reshape(-1, 2)
    try:
        situations = build(rows, ego=EgoPose(*ego), area=area)
    except (InputError, EgoPoseError):
        return
    for name, values in zip(situations._fields, situations, strict=True):
        assert np.isfinite(values).all(), name
