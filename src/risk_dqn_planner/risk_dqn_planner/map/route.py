# SPDX-License-Identifier: Apache-2.0
"""Checks a route against its map, and goes straight on where it is too short to drive."""

import math
from collections.abc import Callable, Collection, Sequence
from itertools import pairwise

from risk_dqn_planner.errors import ConfigurationError, DisconnectedRouteError, RouteError
from risk_dqn_planner.map.loader import Lanelet, RoadMap, lanelet_key

# Directions are taken over this much of a centreline: the first few points may wiggle.
DIRECTION_BASE_M = 2.0


def parse_route(text: str) -> tuple[int, ...]:
    """Read lanelet ids separated by commas.

    Raises:
        ConfigurationError: something else is among them.
    """
    try:
        return tuple(int(part) for part in text.split(","))
    except ValueError as error:
        raise ConfigurationError(
            f"route is {text!r}, expected lanelet ids separated by commas such as 1,9,4"
        ) from error


def resolve_route(road_map: RoadMap, route: Sequence[int]) -> list[Lanelet]:
    """Return the lanelets of a route, two-way ones in the direction in which it drives them.

    Raises:
        RouteError: the route is empty, repeats a lanelet, or uses one closed to vehicles.
        UnknownLaneletError: the map has no such lanelet.
        DisconnectedRouteError: a lanelet does not follow the one before it.
    """
    if not route:
        raise RouteError("the route is empty, expected the ids of one or more lanelets")
    for index, lanelet_id in enumerate(route):
        if lanelet_id in route[:index]:
            raise RouteError(f"the route names lanelet {lanelet_id} twice, expected it once")
    ways = [[lanelet] for lanelet in _directions(road_map, route[0])]
    for previous_id, lanelet_id in pairwise(route):
        keys = {lanelet_key(lanelet) for lanelet in _directions(road_map, lanelet_id)}
        longer = [
            [*way, following]
            for way in ways
            for following in road_map.following(way[-1])
            if lanelet_key(following) in keys
        ]
        if not longer:
            ends = [way[-1] for way in ways]
            raise DisconnectedRouteError(_disconnected(road_map, previous_id, lanelet_id, ends))
        ways = longer
    # As drawn before reversed, where both directions lead through.
    return ways[0]


def _directions(road_map: RoadMap, lanelet_id: int) -> list[Lanelet]:
    """Return the lanelet in each direction that vehicles may drive, as drawn first."""
    lanelet = road_map.lanelet(lanelet_id)
    directions = [way for way in (lanelet, lanelet.invert()) if road_map.drivable(way)]
    if not directions:
        raise RouteError(
            f"lanelet {lanelet_id} of {road_map.path} is closed to vehicles, "
            "expected a route on lanelets that vehicles may drive"
        )
    return directions


def _disconnected(
    road_map: RoadMap, previous_id: int, lanelet_id: int, ends: Sequence[Lanelet]
) -> str:
    following = sorted({int(way.id) for end in ends for way in road_map.following(end)})
    names = ", ".join(map(str, following)) or "none"
    return (
        f"lanelet {lanelet_id} does not follow lanelet {previous_id} of the route on "
        f"{road_map.path}, expected one of those that do: {names}"
    )


def straight_downstream(
    road_map: RoadMap, lanelet: Lanelet, length_m: float, avoid: Collection[int]
) -> list[Lanelet]:
    """Return lanelets that go straightest on after a lanelet, until they cover a length.

    Fewer where the map ends or only lanelets to avoid (by id) follow; none comes twice.
    """
    return _straightest(lanelet, length_m, avoid, road_map.following)


def straight_upstream(
    road_map: RoadMap, lanelet: Lanelet, length_m: float, avoid: Collection[int]
) -> list[Lanelet]:
    """Return lanelets that come straightest before a lanelet, in driving direction."""
    return _straightest(lanelet, length_m, avoid, road_map.previous)[::-1]


def _straightest(
    lanelet: Lanelet,
    length_m: float,
    avoid: Collection[int],
    neighbours: Callable[[Lanelet], list[Lanelet]],
) -> list[Lanelet]:
    """Step from neighbour to neighbour, each time to the one that turns least."""
    seen = {int(lanelet.id), *avoid}
    found: list[Lanelet] = []
    while length_m > 0.0:
        open_ways = [way for way in neighbours(lanelet) if int(way.id) not in seen]
        if not open_ways:
            break
        # Rounding must not decide between equal turns: a rotated map is the same map.
        lanelet = min(open_ways, key=lambda way: (round(turn_rad(way), 3), lanelet_key(way)))
        seen.add(int(lanelet.id))
        found.append(lanelet)
        length_m -= lanelet_length_m(lanelet)
    return found


def turn_rad(lanelet: Lanelet) -> float:
    """Return by how much a lanelet changes direction from its start to its end, unsigned."""
    points = [(point.x, point.y) for point in lanelet.centerline]
    change = _direction(points[::-1]) + math.pi - _direction(points)
    return abs(math.remainder(change, 2.0 * math.pi))


def _direction(points: Sequence[tuple[float, float]]) -> float:
    """Return the heading over the first stretch of a line."""
    start = points[0]
    for point in points[1:]:
        if math.dist(start, point) >= DIRECTION_BASE_M:
            break
    else:
        point = points[-1]
    return math.atan2(point[1] - start[1], point[0] - start[0])


def lanelet_length_m(lanelet: Lanelet) -> float:
    """Return the length of a lanelet's centreline in the plane [m]."""
    points = [(point.x, point.y) for point in lanelet.centerline]
    return sum(math.dist(a, b) for a, b in pairwise(points))
