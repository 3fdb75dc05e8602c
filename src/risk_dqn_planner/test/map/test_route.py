# SPDX-License-Identifier: Apache-2.0
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import lanelet2
import pytest
from lanelet2.core import Lanelet, LaneletMap, LineString3d, Point3d

from risk_dqn_planner.errors import DisconnectedRouteError, RouteError, UnknownLaneletError
from risk_dqn_planner.map.loader import MapOrigin, RoadMap, load_map
from risk_dqn_planner.map.route import (
    resolve_route,
    straight_downstream,
    straight_upstream,
    turn_rad,
)

# Stations of the map: where lanelets may begin and end, left and right border point.
STATIONS = {
    "a": ((0, 1), (0, -1)),
    "b": ((20, 1), (20, -1)),
    "c": ((40, 1), (40, -1)),
    "d": ((60, 1), (60, -1)),
    "left": ((39, 20), (41, 20)),
    "side": ((-1, -20), (1, -20)),
    # A ring, driven counter-clockwise.
    "east": ((209, 0), (211, 0)),
    "north": ((200, 9), (200, 11)),
    "west": ((191, 0), (189, 0)),
    "south": ((200, -9), (200, -11)),
}
Lane = tuple[int, str, str, dict[str, str]]


def draw(folder: Path, lanes: Sequence[Lane]) -> RoadMap:
    points: dict[str, list[Any]] = {
        name: [Point3d(10 * n + k, *xy, 0.0) for k, xy in enumerate(pair, start=1)]
        for n, (name, pair) in enumerate(STATIONS.items())
    }
    lanelet_map = LaneletMap()
    for number, (lane_id, start, end, tags) in enumerate(lanes):
        sides = [
            LineString3d(100 + 2 * number + k, [points[start][k], points[end][k]]) for k in range(2)
        ]
        lanelet = Lanelet(lane_id, sides[0], sides[1])
        for key, value in {
            "subtype": "road", "location": "urban", "one_way": "yes", **tags
        }.items():  # fmt: skip
            lanelet.attributes[key] = value
        lanelet_map.add(lanelet)
    path = folder / "map.osm"
    projector = lanelet2.projection.UtmProjector(lanelet2.io.Origin(49.0, 8.4))
    lanelet2.io.write(str(path), lanelet_map, projector)
    return load_map(path, MapOrigin(49.0, 8.4))


@pytest.fixture
def road_map(tmp_path: Path) -> RoadMap:
    """Lanelets 1 > -2 > 3 straight on, 4 turns left from b, 5 leads from the right to a."""
    return draw(
        tmp_path,
        [
            (1, "a", "b", {}),
            (-2, "b", "c", {}),
            (3, "c", "d", {}),
            (4, "b", "left", {}),
            (5, "side", "a", {}),
            (6, "c", "left", {"subtype": "walkway"}),
        ],
    )


def ids(lanelets: Sequence[Any]) -> list[int]:
    return [int(lanelet.id) for lanelet in lanelets]


def test_a_connected_route_is_resolved_in_order(road_map: RoadMap) -> None:
    assert ids(resolve_route(road_map, [1, -2, 3])) == [1, -2, 3]


def test_an_empty_route_is_refused(road_map: RoadMap) -> None:
    with pytest.raises(RouteError, match="the route is empty"):
        resolve_route(road_map, [])


def test_a_repeated_lanelet_is_refused(road_map: RoadMap) -> None:
    with pytest.raises(RouteError, match="names lanelet 1 twice"):
        resolve_route(road_map, [1, -2, 1])


def test_an_unknown_lanelet_is_refused(road_map: RoadMap) -> None:
    with pytest.raises(UnknownLaneletError, match="lanelet 99 is not among the 6 lanelets"):
        resolve_route(road_map, [1, 99])


def test_a_gap_names_the_pair_and_what_would_follow(road_map: RoadMap) -> None:
    with pytest.raises(
        DisconnectedRouteError, match=r"lanelet 3 does not follow lanelet 1 .* -2, 4$"
    ):
        resolve_route(road_map, [1, 3])


def test_a_gap_at_the_maps_end_says_that_nothing_follows(road_map: RoadMap) -> None:
    with pytest.raises(DisconnectedRouteError, match=r"expected one of those that do: none$"):
        resolve_route(road_map, [3, 1])


def test_a_lanelet_that_is_closed_to_vehicles_is_refused(road_map: RoadMap) -> None:
    with pytest.raises(RouteError, match=r"lanelet 6 of .* is closed to vehicles"):
        resolve_route(road_map, [-2, 6])


def test_a_two_way_lanelet_is_driven_as_the_route_needs(tmp_path: Path) -> None:
    both = {"one_way": "no"}
    road_map = draw(tmp_path, [(1, "a", "b", both), (2, "b", "c", both)])
    forward, backward = resolve_route(road_map, [1, 2]), resolve_route(road_map, [2, 1])
    assert [lanelet.inverted() for lanelet in forward] == [False, False]
    assert [lanelet.inverted() for lanelet in backward] == [True, True]
    assert not resolve_route(road_map, [1])[0].inverted()


def test_the_straightest_way_is_taken_downstream_and_upstream(road_map: RoadMap) -> None:
    assert ids(straight_downstream(road_map, road_map.lanelet(1), 30.0, [])) == [-2, 3]
    assert ids(straight_downstream(road_map, road_map.lanelet(1), 20.0, [])) == [-2]
    assert ids(straight_upstream(road_map, road_map.lanelet(3), 30.0, [])) == [1, -2][:2]
    assert ids(straight_upstream(road_map, road_map.lanelet(3), 500.0, [])) == [5, 1, -2]


def test_lanelets_to_avoid_are_gone_around(road_map: RoadMap) -> None:
    assert ids(straight_downstream(road_map, road_map.lanelet(1), 30.0, [-2])) == [4]
    assert straight_downstream(road_map, road_map.lanelet(1), 30.0, [-2, 4]) == []


def test_a_ring_is_not_driven_twice(tmp_path: Path) -> None:
    ends = ["east", "north", "west", "south", "east"]
    lanes: list[Lane] = [(n, start, end, {}) for n, (start, end) in enumerate(pairwise(ends), 1)]
    road_map = draw(tmp_path, lanes)
    assert ids(straight_downstream(road_map, road_map.lanelet(2), 1000.0, [])) == [3, 4, 1]
    assert ids(straight_upstream(road_map, road_map.lanelet(2), 1000.0, [])) == [3, 4, 1]


def test_turning_is_measured_between_the_directions_at_both_ends(tmp_path: Path) -> None:
    road_map = draw(tmp_path, [(1, "a", "b", {}), (2, "east", "north", {})])
    assert turn_rad(road_map.lanelet(1)) == pytest.approx(0.0, abs=1e-6)
    # Borders are chords here, so that no direction changes but that of the middle line.
    assert turn_rad(road_map.lanelet(2)) < 0.2
