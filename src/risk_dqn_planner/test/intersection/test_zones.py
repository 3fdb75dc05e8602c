# SPDX-License-Identifier: Apache-2.0
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shapely.geometry import Polygon

from risk_dqn_planner.errors import NoConflictError
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.intersection.model import ConflictKind, IntersectingLane, IntersectionModel
from risk_dqn_planner.vehicle import VehicleDimensions

# The class in conftest.py, which tests cannot import.
Sketch = Any
Sketches = Callable[..., Sketch]
NORTH = 0.5 * math.pi
ROUTE = (1, 2, 3)


def northward(sketch: Sketch) -> Sketch:
    """The ego's lanelets 1 > 2 > 3 along x = 0; s = 80 m at the origin."""
    sketch.lane(1, [(0, -80), (0, -10)])
    sketch.lane(2, [(0, -10), (0, 10)])
    sketch.lane(3, [(0, 10), (0, 80)])
    return sketch


def crossing(sketch: Sketch, angle: float, height_m: float = 0.0) -> Sketch:
    """Lanelets 4 > 5 > 6 through the origin at an angle to the ego; s = 100 m there."""
    cos, sin = math.cos(NORTH - angle), math.sin(NORTH - angle)
    for lane, start, end in ((4, -100, -15), (5, -15, 15), (6, 15, 100)):
        points = [(start * cos, start * sin), (end * cos, end * sin)]
        sketch.lane(lane, points, height_m=height_m)
    return northward(sketch)


def only_lane(model: IntersectionModel) -> IntersectingLane:
    (lane,) = model.lanes
    return lane


def arc(x: float, y: float, radius_m: float, degrees: Iterable[float]) -> list[tuple[float, float]]:
    """Points about a centre at angles from east."""
    angles = np.radians(list(degrees))
    return [(x + radius_m * math.cos(a), y + radius_m * math.sin(a)) for a in angles]


def test_perpendicular_crossing_of_ordinary_cars_is_the_six_metres_of_the_paper(
    sketch: Sketches, tmp_path: Path
) -> None:
    model = build_intersection(crossing(sketch(), NORTH).load(tmp_path), ROUTE)
    lane = only_lane(model)
    assert (lane.lane_id, lane.kind) == (5, ConflictKind.CROSSING)
    assert lane.ego_zone_length_m == pytest.approx(6.0, abs=1e-3)
    assert lane.zone_length_m == pytest.approx(6.0, abs=1e-3)
    assert lane.ego_zone_center_m == pytest.approx(80.0, abs=1e-3)
    (path,) = lane.paths
    assert path.zone_center_m == pytest.approx(100.0, abs=1e-3)
    assert path.path.lanelet_ids == (4, 5, 6)
    assert path.path.lanelet_starts_m == pytest.approx((0.0, 85.0, 115.0), abs=1e-3)
    assert path.path.half_width_m == pytest.approx(1.75, abs=1e-3)
    assert path.join_m == lane.ego_join_m == math.inf
    assert model.ego_path.lanelet_ids == ROUTE


@pytest.mark.parametrize("degrees", [30.0, 60.0, 120.0])
def test_oblique_crossing_is_longer_by_the_corner_that_cuts_in(
    sketch: Sketches, tmp_path: Path, degrees: float
) -> None:
    angle = math.radians(degrees)
    lane = only_lane(build_intersection(crossing(sketch(), angle).load(tmp_path), ROUTE))
    # Two strips 2 m wide overlap in a rhombus; its far corner lies (1 + |cos|) / sin from the
    # centre along the ego's near side, and half a car of 2 m comes on top, on either side.
    half = 2.0 + (1.0 + abs(math.cos(angle))) / math.sin(angle)
    assert lane.ego_zone_length_m == pytest.approx(2.0 * half, abs=2e-3)
    assert lane.zone_length_m == pytest.approx(2.0 * half, abs=2e-3)
    assert lane.ego_zone_center_m == pytest.approx(80.0, abs=1e-3)


def test_zone_of_unlike_vehicles_takes_each_ones_length_and_the_others_width(
    sketch: Sketches, tmp_path: Path
) -> None:
    config = IntersectionConfig(
        ego_dimensions=VehicleDimensions(5.0, 1.8), traffic_dimensions=VehicleDimensions(10.0, 2.4)
    )
    road_map = crossing(sketch(), NORTH).load(tmp_path)
    lane = only_lane(build_intersection(road_map, ROUTE, config))
    assert lane.ego_zone_length_m == pytest.approx(5.0 + 2.4, abs=1e-3)
    assert lane.zone_length_m == pytest.approx(10.0 + 1.8, abs=1e-3)


@pytest.mark.parametrize(("height_m", "lanes"), [(2.0, 1), (6.0, 0)])
def test_a_bridge_is_no_conflict(
    sketch: Sketches, tmp_path: Path, height_m: float, lanes: int
) -> None:
    road_map = crossing(sketch(), NORTH, height_m).load(tmp_path)
    if lanes:
        assert len(build_intersection(road_map, ROUTE).lanes) == lanes
    else:
        with pytest.raises(NoConflictError, match=r"map\.osm conflicts with the route 1 > 2 > 3"):
            build_intersection(road_map, ROUTE)


def merge(sketch: Sketch) -> Sketch:
    """Lanelets 7 > 8 come from the west in a quarter circle of 30 m and end where 2 ends."""
    northward(sketch)
    bend = arc(-30.0, -20.0, 30.0, np.linspace(-90.0, 0.0, 31))
    sketch.lane(7, [(-100, -50), (-30, -50)])
    sketch.lane(8, [*bend, (0, 10)])
    return sketch


def test_merging_zone_ends_where_the_lines_have_joined(sketch: Sketches, tmp_path: Path) -> None:
    model = build_intersection(merge(sketch()).load(tmp_path), ROUTE)
    lane = only_lane(model)
    assert (lane.lane_id, lane.kind) == (8, ConflictKind.MERGING)
    (path,) = lane.paths
    # The way follows the ego's path after the merge.
    assert path.path.lanelet_ids == (7, 8, 3)
    # Lines of 25 cm apart are one: on a circle of 30 m that is sqrt(2 * 30 * 0.25) = 3.87 m
    # before its end at y = -20, which is s = 60 m on the ego's path. Smoothing moves the bend
    # by some centimetres.
    assert lane.ego_join_m == pytest.approx(60.0 - 3.87, abs=0.5)
    ego_end = lane.ego_zone_center_m + 0.5 * lane.ego_zone_length_m
    own_end = path.zone_center_m + 0.5 * lane.zone_length_m
    assert ego_end == pytest.approx(lane.ego_join_m, abs=1e-6)
    assert own_end == pytest.approx(path.join_m, abs=1e-6)
    # From the join on, both arc lengths run alike: the same point is as far behind either.
    x, y = path.path.centerline.position(path.join_m + 30.0)
    beside = model.ego_path.centerline.project(x, y)
    assert beside.s == pytest.approx(lane.ego_join_m + 30.0, abs=0.1)
    assert abs(beside.lateral_m) < 0.01


def test_merging_zone_begins_where_the_cars_first_touch(sketch: Sketches, tmp_path: Path) -> None:
    lane = only_lane(build_intersection(merge(sketch()).load(tmp_path), ROUTE))
    # Sought by brute force: the least ego position at which some position of the other, not
    # yet past the join, touches. Cars are shorter than the bend, so the answer lies on it.
    touching = [
        (-80.0 + s, angle)
        for s in np.arange(40.0, 57.0, 0.2)
        for angle in np.radians(np.arange(-50.0, -7.0, 0.5))
        if boxes_touch(
            (0.0, -80.0 + s, NORTH),
            (-30.0 + 30.0 * math.cos(angle), -20.0 + 30.0 * math.sin(angle), angle + NORTH),
        )
    ]
    first_ego = 80.0 + min(y for y, _ in touching)
    assert lane.ego_zone_center_m - 0.5 * lane.ego_zone_length_m == pytest.approx(
        first_ego, abs=0.25
    )


def boxes_touch(first: tuple[float, float, float], second: tuple[float, float, float]) -> bool:
    """An overlap test that shares nothing with the planner's: shapely polygons."""
    boxes = []
    for x, y, heading in (first, second):
        cos, sin = math.cos(heading), math.sin(heading)
        corners = ((2, 1), (-2, 1), (-2, -1), (2, -1))
        boxes.append(Polygon([(x + a * cos - b * sin, y + a * sin + b * cos) for a, b in corners]))
    return bool(boxes[0].intersects(boxes[1]))


def test_a_lane_that_diverges_from_the_egos_is_no_conflict(
    sketch: Sketches, tmp_path: Path
) -> None:
    drawn = northward(sketch())
    drawn.lane(9, arc(30.0, -10.0, 30.0, np.linspace(180.0, 90.0, 31)))
    with pytest.raises(NoConflictError):
        build_intersection(drawn.load(tmp_path), ROUTE)


def test_a_hairline_touch_is_no_conflict(sketch: Sketches, tmp_path: Path) -> None:
    # Beside the ego's lane, 2.02 m away: lanelets overlap, cars pass. At 1.98 m they touch.
    for offset, lanes in ((2.02, 0), (1.98, 1)):
        drawn = northward(sketch())
        drawn.lane(9, [(offset, 40), (offset, -40)])
        if lanes:
            assert only_lane(build_intersection(drawn.load(tmp_path), ROUTE)).lane_id == 9
        else:
            with pytest.raises(NoConflictError):
                build_intersection(drawn.load(tmp_path), ROUTE)


def test_consecutive_lanelets_in_contact_are_one_lane_named_after_the_last(
    sketch: Sketches, tmp_path: Path
) -> None:
    drawn = northward(sketch())
    for lane_id, start, end in ((4, -100, -15), (50, -15, 0.5), (51, 0.5, 15), (6, 15, 100)):
        drawn.lane(lane_id, [(start, 0), (end, 0)])
    model = build_intersection(drawn.load(tmp_path), ROUTE)
    lane = only_lane(model)
    assert lane.lane_id == 51
    assert lane.zone_length_m == pytest.approx(6.0, abs=1e-3)
    assert lane.paths[0].path.lanelet_ids == (4, 50, 51, 6)
    assert lane.paths[0].zone_center_m == pytest.approx(100.0, abs=1e-3)


def test_every_upstream_branch_within_sensor_range_is_a_path(
    sketch: Sketches, tmp_path: Path
) -> None:
    drawn = northward(sketch())
    drawn.lane(5, [(-40, 0), (15, 0)])
    drawn.lane(6, [(15, 0), (100, 0)])
    drawn.lane(10, [(-140, 0), (-40, 0)])
    drawn.lane(11, arc(-40.0, 15.0, 15.0, np.linspace(180.0, 270.0, 31)))
    drawn.lane(12, [(-55, 100), (-55, 15)])
    drawn.lane(13, [(-240, 0), (-140, 0)])
    model = build_intersection(drawn.load(tmp_path), ROUTE)
    lane = only_lane(model)
    # The zone begins 37 m after the start of 5: the 100 m of 10 reach 70 m, the 24 m of 11 do
    # not, so 12 is needed and 13 is not.
    assert [path.path.lanelet_ids for path in lane.paths] == [(10, 5, 6), (12, 11, 5, 6)]
    for path in lane.paths:
        assert path.path.centerline.position(path.zone_center_m) == pytest.approx(
            (0.0, 0.0), abs=0.01
        )


def test_what_comes_along_the_egos_own_lane_is_not_upstream_traffic(
    sketch: Sketches, tmp_path: Path
) -> None:
    # 20 leaves the ego's lanelet 1 to the right, turns round and crosses 2 > 3 from the east.
    drawn = northward(sketch())
    loop = [
        *arc(20.0, -10.0, 20.0, np.linspace(180.0, 90.0, 31)),
        *arc(20.0, 25.0, 15.0, np.linspace(-90.0, 90.0, 31)),
        (10, 40),
    ]
    drawn.lane(20, loop)
    drawn.lane(21, [(10, 40), (-40, 40)])
    lane = only_lane(build_intersection(drawn.load(tmp_path), ROUTE))
    assert lane.lane_id == 21
    assert lane.paths[0].path.lanelet_ids == (20, 21)


def test_a_lanelet_that_crosses_and_later_merges_is_two_lanes(
    sketch: Sketches, tmp_path: Path
) -> None:
    # 8 crosses the ego's path from west to east, turns back in a half circle and merges.
    drawn = northward(sketch())
    weave = [
        (-30, -60),
        *arc(10.0, -40.0, 20.0, np.linspace(-90.0, 90.0, 41)),
        *arc(10.0, -10.0, 10.0, np.linspace(270.0, 180.0, 21)),
        (0, 10),
    ]
    drawn.lane(8, weave)
    model = build_intersection(drawn.load(tmp_path), ROUTE)
    kinds = [(lane.lane_id, lane.kind) for lane in model.lanes]
    # Ids: the zone met first keeps the lanelet's, the other gets the next free one.
    assert kinds == [(8, ConflictKind.CROSSING), (9, ConflictKind.MERGING)]
    # The crossing is at right angles at y = -60, 20 m along the ego's path.
    assert model.lanes[0].ego_zone_center_m == pytest.approx(20.0, abs=1e-2)
    assert model.lanes[0].ego_zone_length_m == pytest.approx(6.0, abs=1e-2)


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.3])
def test_moving_or_turning_the_whole_map_changes_nothing(
    sketch: Sketches, tmp_path: Path, turn: float
) -> None:
    def build(sketch_: Sketch) -> IntersectionModel:
        merge(crossing(sketch_, math.radians(65.0)))
        sketch_.line(90, [(-1.75, -7.5), (1.75, -7.5)], "stop_line")
        return build_intersection(sketch_.load(tmp_path), ROUTE)

    still, moved = build(sketch()), build(sketch(turn, (813.7, -250.3)))
    assert [lane.lane_id for lane in still.lanes] == [lane.lane_id for lane in moved.lanes]
    assert moved.goal_m == pytest.approx(still.goal_m, abs=1e-3)
    assert moved.stop_line.position_m == pytest.approx(still.stop_line.position_m, abs=1e-3)
    for before, after in zip(still.lanes, moved.lanes, strict=True):
        assert numbers(after) == pytest.approx(numbers(before), abs=1e-3)
        for own, other in zip(before.paths, after.paths, strict=True):
            assert own.path.lanelet_ids == other.path.lanelet_ids
            assert other.zone_center_m == pytest.approx(own.zone_center_m, abs=1e-3)


def numbers(lane: IntersectingLane) -> list[float]:
    return [
        lane.ego_zone_center_m,
        lane.ego_zone_length_m,
        lane.zone_length_m,
        lane.ego_join_m,
        lane.speed_limit_mps,
    ]
