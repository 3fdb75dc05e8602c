# SPDX-License-Identifier: Apache-2.0
"""Real maps, which are not part of the project: RISK_DQN_MAPS, or ../shared/maps beside it."""

import os
import time
from functools import cache
from pathlib import Path

import pytest

from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.model import ConflictKind
from risk_dqn_planner.map.loader import MapOrigin, RoadMap, load_map

BESIDE_THE_PROJECT = Path(__file__).resolve().parents[4].parent / "shared" / "maps"
MAPS = Path(os.environ.get("RISK_DQN_MAPS", BESIDE_THE_PROJECT))
FILES = {
    "wdr": ("wdr/wdr.osm", MapOrigin(50.970, 6.852)),
    "karlsruhe": ("karlsruhe/mapping_example.osm", MapOrigin(49.0, 8.4)),
    "kashiwanoha": ("kashiwanoha/kashiwanoha.osm", None),
}

pytestmark = pytest.mark.skipif(
    not MAPS.is_dir(), reason=f"no real maps at {MAPS}; set RISK_DQN_MAPS to their folder"
)


@cache
def load(name: str) -> RoadMap:
    file, origin = FILES[name]
    return load_map(MAPS / file, origin)


# Routes with the lanes that cross and that merge, and the map's stop line if one fits. Where
# lanelets merely overlap, a count by overlap would be higher: see the comments.
WDR = [
    # 11615 only runs along the ego's exit, the other way.
    ([1489, 11482, 844], {11198, 11877, 12077, 12283, 12485}, {11351, 11744}, -11251),
    # -1571 leads into -1586 and is part of its lane; 14568 and 14699 pass alongside.
    ([6942, 14391, 6236], {14107, 14214}, {-1586, 13944}, -11262),
    ([3476, 16497, 2342], {16685, 16883}, {16974}, None),
    ([1639, 13423, 2547], {-1153, -1154}, {13172}, None),
    ([-1247, -1274, 8394], {-1249, -1276, -1278, 9994, 10127, 10448}, {10238, 10551}, None),
    ([6645, 17684, 6828], {17383, 17589}, {17268}, None),
    ([5768, -1476, 4089], {-1409, -1488}, {-1452}, -11257),
    ([8700, 15908, 2331], set(), {15707}, None),
]
KARLSRUHE = [
    # 45128 continues a right turn that diverges from the ego's lane. Right of way 45236 names
    # stop line 43548, which belongs elsewhere.
    (
        [45124, 45000, 45002],
        {45094, 45064, 44996, 45030, 44988, 44992},
        {45078, 44994},
        43606,
    ),
    # 45478 is two-way: it merges one way and crosses the other, so it has a second id.
    ([45482, 45484, 45542], {45480, 45479}, {45478}, None),
    # A roundabout of two lanes; lanelets in succession are one lane.
    (
        [2494187620681288553, 6863241492471799904, 6200113967165995538],
        {1230696026783469716, 3096645840465895340},
        {6923355182620813640},
        None,
    ),
    (
        [8717970484406193818, 5820064232837944307, 9178926741377113721],
        {5872433480342781773, 3966054957584072627},
        set(),
        43258,
    ),
]
ROUTES = [("wdr", *row) for row in WDR] + [("karlsruhe", *row) for row in KARLSRUHE]


@pytest.mark.parametrize(("name", "route", "crossing", "merging", "stop_line"), ROUTES)
def test_lanes_and_stop_line_of_real_routes(
    name: str, route: list[int], crossing: set[int], merging: set[int], stop_line: int | None
) -> None:
    model = build_intersection(load(name), route)
    found = {
        kind: {lane.lane_id for lane in model.lanes if lane.kind is kind} for kind in ConflictKind
    }
    assert found == {ConflictKind.CROSSING: crossing, ConflictKind.MERGING: merging}
    assert model.stop_line.lanelet2_id == stop_line


@pytest.mark.parametrize(("name", "route", "crossing", "merging", "stop_line"), ROUTES)
def test_models_of_real_routes_are_sound(
    name: str, route: list[int], crossing: set[int], merging: set[int], stop_line: int | None
) -> None:
    model = build_intersection(load(name), route)
    assert len(model.lanes) == len(crossing) + len(merging)
    assert model.stop_line.derived == (stop_line is None)
    starts = [lane.ego_zone_center_m - 0.5 * lane.ego_zone_length_m for lane in model.lanes]
    assert 0.0 < min(starts) - model.stop_line.position_m <= 15.0
    assert model.goal_m <= model.ego_path.centerline.length_m
    centers = [(lane.ego_zone_center_m, lane.lane_id) for lane in model.lanes]
    assert centers == sorted(centers)
    assert len({lane.lane_id for lane in model.lanes}) == len(model.lanes)
    for lane in model.lanes:
        # No zone is shorter than a car touches a point, none as long as a street.
        assert 3.0 < lane.ego_zone_length_m < 20.0
        assert 3.0 < lane.zone_length_m < 20.0
        for path in lane.paths:
            ids = path.path.lanelet_ids
            assert len(set(ids)) == len(ids)
            start_m = path.zone_center_m - 0.5 * lane.zone_length_m
            before = ids[: sum(begin < start_m for begin in path.path.lanelet_starts_m)]
            assert not set(before) & set(model.ego_path.lanelet_ids)


def test_speed_limits_of_the_quarter_are_thirty_and_not_the_fifty_of_the_rules() -> None:
    model = build_intersection(load("wdr"), [1489, 11482, 844])
    assert {round(3.6 * lane.speed_limit_mps, 9) for lane in model.lanes} == {30.0}


def test_where_a_map_has_no_limits_the_default_stands() -> None:
    model = build_intersection(load("karlsruhe"), [45124, 45000, 45002])
    assert {lane.speed_limit_mps for lane in model.lanes} == {7.0}


def test_a_stop_line_that_belongs_elsewhere_is_named() -> None:
    model = build_intersection(load("karlsruhe"), [45124, 45000, 45002])
    assert "stop line 43548 is not used: it does not cross the ego's path" in model.notes


def test_a_left_hand_map_loads_and_its_routes_build() -> None:
    road_map = load("kashiwanoha")
    assert len(road_map.lanelet_map.laneletLayer) == 81
    model = build_intersection(road_map, [34408, 34645, 34621])
    kinds = [lane.kind for lane in model.lanes]
    assert (kinds.count(ConflictKind.CROSSING), kinds.count(ConflictKind.MERGING)) == (5, 2)


def test_a_model_is_built_within_a_second() -> None:
    road_map = load("wdr")
    durations = []
    for _ in range(3):
        start = time.perf_counter()
        build_intersection(road_map, [1489, 11482, 844])
        durations.append(time.perf_counter() - start)
    assert min(durations) < 1.0
