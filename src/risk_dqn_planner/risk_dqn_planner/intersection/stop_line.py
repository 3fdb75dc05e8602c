# SPDX-License-Identifier: Apache-2.0
"""Finds where the ego should wait: at a line of the map if one fits, else before the first zone.

Maps refer to lines that belong elsewhere, lie past the first conflict, or are not marked as
stop lines at all, so every line is judged by where it crosses the ego's path.
"""

from collections.abc import Sequence

import numpy as np
from lanelet2.core import BasicPoint2d, BoundingBox2d, SpeedLimit

from risk_dqn_planner.errors import MapError
from risk_dqn_planner.geometry.contact import Interval
from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.intersection.ego_route import EgoRoute
from risk_dqn_planner.intersection.model import StopLine
from risk_dqn_planner.map.loader import Lanelet, LineString, RegulatoryElement, RoadMap

# Roles of lanelet2's regulatory elements: the line to wait at, and who has to.
LINE_ROLE = "ref_line"
YIELD_ROLE = "yield"


def find_stop_line(
    road_map: RoadMap, ego: EgoRoute, first_zone: Interval, config: IntersectionConfig
) -> tuple[StopLine, list[str]]:
    """Return the stop line before the first zone (an interval of ego arc length), and notes.

    A line fits if the ego's centre, with its front at the line, rests before the zone and at
    most `max_stop_line_distance_m` from it. The nearest that fits is taken; without one, the
    position is derived from the zone.
    """
    notes: list[str] = []
    best: StopLine | None = None
    for line_id, line, referred in _lines(road_map, ego, first_zone):
        for at in _crossings(ego, line):
            rest_m = at - 0.5 * config.ego_dimensions.length_m
            reason = _misfit(first_zone.start - rest_m, config)
            if reason is None:
                if best is None or rest_m > best.position_m:
                    best = StopLine(rest_m, line_id)
            elif referred or _on_route(ego, at):
                notes.append(f"stop line {line_id} is not used: {reason}")
        if referred and len(_crossings(ego, line)) == 0:
            notes.append(f"stop line {line_id} is not used: it does not cross the ego's path")
    if best is not None:
        return best, notes
    position_m = first_zone.start - config.stop_line_setback_m
    notes.append(
        "the map has no stop line that fits, so the ego is to wait "
        f"{config.stop_line_setback_m:g} m before the first conflict zone"
    )
    return StopLine(position_m, None), notes


def _misfit(before_zone_m: float, config: IntersectionConfig) -> str | None:
    """Return why a resting place this far before the first zone is none, or None if it is."""
    if before_zone_m <= 0.0:
        return f"the ego would stand {-before_zone_m:.1f} m inside or past the first conflict zone"
    if before_zone_m > config.max_stop_line_distance_m:
        return (
            f"the ego would stand {before_zone_m:.1f} m before the first conflict zone, "
            f"farther than {config.max_stop_line_distance_m:g} m"
        )
    return None


def _on_route(ego: EgoRoute, at: float) -> bool:
    route = ego.route_stretch
    return route.start <= at <= route.end


def _crossings(ego: EgoRoute, line: Polyline) -> list[float]:
    return [float(at) for at in ego.chain.centerline.crossings(line)]


def _lines(
    road_map: RoadMap, ego: EgoRoute, first_zone: Interval
) -> list[tuple[int, Polyline, bool]]:
    """Return (id, line, referred): lines that may be meant for the ego, by id.

    Referred ones are named by a regulatory element that binds a lanelet of the ego's path up
    to the first zone; the others are painted stop lines near the path.
    """
    bound = [
        lanelet
        for lanelet, start_m in zip(ego.chain.lanelets, ego.chain.starts_m, strict=True)
        if start_m < first_zone.start
    ]
    found: dict[int, tuple[LineString, bool]] = {}
    for line in road_map.lanelet_map.lineStringLayer.search(_box(ego)):
        if "type" in line.attributes and line.attributes["type"] == "stop_line":
            found[int(line.id)] = (line, False)
    # Maps do not always list an element on its lanelets, so all elements are asked.
    for element in road_map.lanelet_map.regulatoryElementLayer:
        if not isinstance(element, SpeedLimit) and _binds(element, bound):
            for line in _role(element, LINE_ROLE):
                found[int(line.id)] = (line, True)
    lines = []
    for line_id, (line, referred) in sorted(found.items()):
        try:
            polyline = Polyline.from_points([(point.x, point.y) for point in line])
        except MapError:
            continue  # A single point crosses nothing.
        lines.append((line_id, polyline, referred))
    return lines


def _binds(element: RegulatoryElement, lanelets: Sequence[Lanelet]) -> bool:
    """Tell whether a regulatory element makes vehicles wait on one of the lanelets."""
    yielding = {int(lanelet.id) for lanelet in _role(element, YIELD_ROLE)}
    if yielding:
        return any(int(lanelet.id) in yielding for lanelet in lanelets)
    return any(
        int(element.id) == int(own.id) for lanelet in lanelets for own in lanelet.regulatoryElements
    )


def _role(element: RegulatoryElement, role: str) -> list[LineString]:
    """Return what an element keeps under a role, nothing if it lacks the role."""
    parameters = element.parameters
    return list(parameters[role]) if role in parameters else []


def _box(ego: EgoRoute) -> BoundingBox2d:
    low, high = np.min(ego.chain.centerline.xy, axis=0), np.max(ego.chain.centerline.xy, axis=0)
    return BoundingBox2d(BasicPoint2d(*map(float, low)), BasicPoint2d(*map(float, high)))
