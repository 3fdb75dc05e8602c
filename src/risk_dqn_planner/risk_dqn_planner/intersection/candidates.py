# SPDX-License-Identifier: Apache-2.0
"""Lanelets that may conflict with the ego's route.

lanelet2's own list of conflicting lanelets ignores height, holds diverging siblings, and, for
two-way lanelets, the lanelet itself; so the overlap is asked of the geometry directly.
"""

from lanelet2.core import BasicPoint2d, BoundingBox2d
from lanelet2.geometry import overlaps2d

from risk_dqn_planner.intersection.ego_route import EgoRoute
from risk_dqn_planner.map.loader import Lanelet, RoadMap, lanelet_key


def candidates(road_map: RoadMap, ego: EgoRoute, margin_m: float) -> list[Lanelet]:
    """Return lanelets off the ego's path whose area overlaps the route's, by id.

    Two-way lanelets come once for each direction. margin_m widens the search about a lanelet.
    """
    found: dict[tuple[int, bool], Lanelet] = {}
    for route_lanelet in ego.route_lanelets:
        for lanelet in road_map.lanelet_map.laneletLayer.search(_box(route_lanelet, margin_m)):
            if int(lanelet.id) in ego.ids or not overlaps2d(route_lanelet, lanelet):
                continue
            for way in (lanelet, lanelet.invert()):
                if road_map.drivable(way):
                    found[lanelet_key(way)] = way
    return [found[key] for key in sorted(found)]


def _box(lanelet: Lanelet, margin_m: float) -> BoundingBox2d:
    points = [*lanelet.leftBound, *lanelet.rightBound]
    xs, ys = [point.x for point in points], [point.y for point in points]
    return BoundingBox2d(
        BasicPoint2d(min(xs) - margin_m, min(ys) - margin_m),
        BasicPoint2d(max(xs) + margin_m, max(ys) + margin_m),
    )
