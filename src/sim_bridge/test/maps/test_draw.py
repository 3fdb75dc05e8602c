# SPDX-License-Identifier: Apache-2.0
import math
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from risk_dqn_planner.errors import MapFileError
from risk_dqn_planner.map.loader import RoadMap, load_map
from risk_dqn_planner.map.route import resolve_route
from sim_bridge.maps import map_names, shipped_map
from sim_bridge.maps.draw import draw_maps

NAMES = ("four_way", "t_junction", "multi_lane", "roundabout")
METRES_PER_DEGREE = 111_000.0


def load(name: str) -> RoadMap:
    shipped = shipped_map(name)
    return load_map(shipped.path, shipped.origin)


def elements(path: Path) -> list[tuple[str, dict[str, str]]]:
    return [(element.tag, dict(element.attrib)) for element in ET.parse(path).iter()]  # noqa: S314


def test_drawing_again_gives_the_committed_files(tmp_path: Path) -> None:
    for drawn in draw_maps(tmp_path):
        fresh, committed = elements(drawn), elements(shipped_map(drawn.stem).path)
        assert len(fresh) == len(committed)
        for (tag, values), (committed_tag, committed_values) in zip(fresh, committed, strict=True):
            for key in ("lat", "lon"):
                # The last digit depends on the machine's mathematical library.
                moved = float(values.pop(key, 0)) - float(committed_values.pop(key, 0))
                assert abs(moved) * METRES_PER_DEGREE < 1e-4
            assert (tag, values) == (committed_tag, committed_values)


def test_drawing_twice_gives_the_same_bytes(tmp_path: Path) -> None:
    once = [path.read_bytes() for path in draw_maps(tmp_path / "once")]
    again = [path.read_bytes() for path in draw_maps(tmp_path / "again")]
    assert once == again


def test_every_map_is_listed_and_an_unknown_name_tells_which_there_are() -> None:
    assert tuple(map_names()) == NAMES
    with pytest.raises(MapFileError, match="four_way, t_junction, multi_lane, roundabout"):
        shipped_map("cloverleaf")


@pytest.mark.parametrize("name", NAMES)
def test_the_default_route_can_be_driven(name: str) -> None:
    shipped = shipped_map(name)
    lanelets = resolve_route(load(name), shipped.route)
    assert [lanelet.id for lanelet in lanelets] == list(shipped.route)


@pytest.mark.parametrize("name", NAMES)
def test_every_lane_has_the_speed_limit_and_ends_where_the_next_begins(name: str) -> None:
    road_map = load(name)
    for lanelet in road_map.lanelet_map.laneletLayer:
        limit_kmh = road_map.traffic_rules.speedLimit(lanelet).speedLimit
        assert limit_kmh == pytest.approx(7.0 * 3.6)
        for following in road_map.following(lanelet):
            end, start = lanelet.centerline[-1], following.centerline[0]
            assert math.dist((end.x, end.y), (start.x, start.y)) < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_lanes_are_three_and_a_half_metres_wide_at_both_ends(name: str) -> None:
    for lanelet in load(name).lanelet_map.laneletLayer:
        for end in (0, -1):
            left, right = lanelet.leftBound[end], lanelet.rightBound[end]
            assert math.dist((left.x, left.y), (right.x, right.y)) == pytest.approx(3.5, abs=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_every_yielding_lane_is_crossed_by_its_stop_line(name: str) -> None:
    road_map = load(name)
    rules = [
        rule
        for rule in road_map.lanelet_map.regulatoryElementLayer
        if rule.attributes["subtype"] == "right_of_way"
    ]
    assert rules
    for rule in rules:
        assert rule.stopLine.attributes["type"] == "stop_line"
        (lane,) = rule.yieldLanelets()
        xs = [point.x for point in (*lane.leftBound, *lane.rightBound)]
        ys = [point.y for point in (*lane.leftBound, *lane.rightBound)]
        for point in rule.stopLine:
            assert min(xs) - 1e-3 <= point.x <= max(xs) + 1e-3
            assert min(ys) - 1e-3 <= point.y <= max(ys) + 1e-3


def test_the_four_way_crossing_is_that_of_the_paper() -> None:
    road_map = load("four_way")
    crossing, eastbound, westbound = (road_map.lanelet(key) for key in (9, 11, 12))
    assert {round(point.x, 4) for point in crossing.centerline} == {1.75}
    assert {round(point.y, 4) for point in eastbound.centerline} == {-1.75}
    assert {round(point.y, 4) for point in westbound.centerline} == {1.75}
