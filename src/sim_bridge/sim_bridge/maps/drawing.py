# SPDX-License-Identifier: Apache-2.0
"""Pen and ruler for Lanelet2 maps: points, borders and lanelets, shared where they coincide.

Ids are handed out in the order of drawing, so that the same drawing gives the same file.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import lanelet2

from risk_dqn_planner.map.loader import Lanelet, LineString, MapOrigin

Point = tuple[float, float]
# lanelet2's Python objects carry no types, or incomplete ones.
MapPoint = Any
Rule = Any
core: Any = lanelet2.core

LANE_WIDTH_M = 3.5
CURVE_POINTS = 24
KMH_PER_MPS = 3.6


@dataclass(frozen=True)
class End:
    """One end of a lane: its left and right border points and its driving direction."""

    left: Point
    right: Point
    heading: float


@dataclass(frozen=True)
class Arm:
    """A straight road that ends at a junction about the origin; right-hand traffic.

    direction: from the junction outwards [rad]. inner_m, outer_m: where it begins and ends.
    lanes: in each driving direction. Its lines are numbered from the middle line, 0, upwards
    to the left as seen outwards: lanes into the junction lie there.
    """

    direction: float
    inner_m: float
    outer_m: float
    lanes: int = 1

    def point(self, line: int, distance_m: float) -> Point:
        """Return the point on a line at a distance from the junction's centre."""
        cos, sin = math.cos(self.direction), math.sin(self.direction)
        aside = line * LANE_WIDTH_M
        return distance_m * cos - aside * sin, distance_m * sin + aside * cos

    def into(self, lane: int = 0) -> "End":
        """Return where a lane reaches the junction; lane 0 is next to the middle line."""
        left, right = self.point(lane, self.inner_m), self.point(lane + 1, self.inner_m)
        return End(left, right, self.direction + math.pi)

    def out_of(self, lane: int = 0) -> "End":
        """Return where a lane leaves the junction."""
        left, right = self.point(-lane, self.inner_m), self.point(-lane - 1, self.inner_m)
        return End(left, right, self.direction)


class Drawing:
    """A map under construction; lanelets have ids from 1, everything else its own range."""

    def __init__(self) -> None:
        self.lanelet_map = lanelet2.core.LaneletMap()
        self._points: dict[Point, MapPoint] = {}
        self._lines: dict[tuple[int, ...], LineString] = {}
        self._lanelet_ids = count(1)
        self._rule_ids = count(500)
        self._line_ids = count(1000)
        self._point_ids = count(10000)

    def lane(self, left: Sequence[Point], right: Sequence[Point], **attributes: str) -> Lanelet:
        """Draw a lanelet between two borders, both given in driving direction."""
        lanelet = lanelet2.core.Lanelet(
            next(self._lanelet_ids), self._border(left), self._border(right)
        )
        tags = {"subtype": "road", "location": "urban", "one_way": "yes", **attributes}
        for key, value in tags.items():
            lanelet.attributes[key] = value
        self.lanelet_map.add(lanelet)
        return lanelet

    def arm(self, arm: Arm) -> tuple[list[Lanelet], list[Lanelet]]:
        """Draw a road; returns its lanes into and out of the junction, innermost first."""
        lines = {
            line: [arm.point(line, arm.inner_m), arm.point(line, arm.outer_m)]
            for line in range(-arm.lanes, arm.lanes + 1)
        }
        into = [self.lane(lines[lane][::-1], lines[lane + 1][::-1]) for lane in range(arm.lanes)]
        out_of = [self.lane(lines[-lane], lines[-lane - 1]) for lane in range(arm.lanes)]
        for line, points in lines.items():
            if abs(line) == arm.lanes:
                self.mark(points, "road_border")
            else:
                self.mark(points, "line_thin", "solid" if line == 0 else "dashed")
        return into, out_of

    def connect(self, start: End, end: End, **attributes: str) -> Lanelet:
        """Draw a lanelet from one lane's end to another's beginning, straight or curved."""
        left = curve(start.left, start.heading, end.left, end.heading)
        right = curve(start.right, start.heading, end.right, end.heading)
        return self.lane(left, right, **attributes)

    def limit_speed(self, lanelets: Sequence[Lanelet], limit_mps: float) -> None:
        """Put up a speed limit for lanelets."""
        text = f"{limit_mps * KMH_PER_MPS:.6g} km/h"
        attributes = lanelet2.core.AttributeMap({"sign_type": text})
        signs = core.TrafficSignsWithType([], text)
        rule = lanelet2.core.SpeedLimit(next(self._rule_ids), attributes, signs)
        # The class alone says so in memory; in the file, the subtype does.
        rule.attributes["subtype"] = "speed_limit"
        self._regulate(rule, lanelets)

    def yield_at(
        self, line: Sequence[Point], yielding: Sequence[Lanelet], priority: Sequence[Lanelet]
    ) -> None:
        """Draw a stop line at which some lanelets give way to others."""
        stop_line = self._border(line, "stop_line")
        rule = lanelet2.core.RightOfWay(
            next(self._rule_ids),
            lanelet2.core.AttributeMap({}),
            list(priority),
            list(yielding),
            stop_line,
        )
        self._regulate(rule, [*yielding, *priority])

    def mark(self, points: Sequence[Point], kind: str, subtype: str | None = None) -> None:
        """Say what a border looks like; without this it is virtual (not painted)."""
        line = self._border(points)
        line.attributes["type"] = kind
        if subtype is not None:
            line.attributes["subtype"] = subtype

    def write(self, path: Path, origin: MapOrigin) -> None:
        """Write the map as OSM file; coordinates become those of UTM about the origin."""
        anchor = lanelet2.io.Origin(origin.latitude_deg, origin.longitude_deg)
        projector = lanelet2.projection.UtmProjector(anchor)
        lanelet2.io.write(str(path), self.lanelet_map, projector)

    def _regulate(self, rule: Rule, lanelets: Sequence[Lanelet]) -> None:
        for lanelet in lanelets:
            lanelet.addRegulatoryElement(rule)
        self.lanelet_map.add(rule)

    def _border(self, points: Sequence[Point], kind: str = "virtual") -> LineString:
        """Return the line through points, the same one for both directions."""
        drawn = [self._point(point) for point in points]
        key = tuple(point.id for point in drawn)
        if key[::-1] in self._lines:
            return self._lines[key[::-1]].invert()
        if key not in self._lines:
            line = lanelet2.core.LineString3d(next(self._line_ids), drawn)
            line.attributes["type"] = kind
            self._lines[key] = line
            self.lanelet_map.add(line)
        return self._lines[key]

    def _point(self, point: Point) -> MapPoint:
        key = (round(point[0], 4) + 0.0, round(point[1], 4) + 0.0)
        if key not in self._points:
            self._points[key] = lanelet2.core.Point3d(next(self._point_ids), *key, 0.0)
        return self._points[key]


def curve(start: Point, start_heading: float, end: Point, end_heading: float) -> list[Point]:
    """Return points from one pose to another: a straight line, or a bend close to an arc."""
    turn = math.sin(end_heading - start_heading)
    if abs(turn) < 1e-9:
        return [start, end]
    cos_start, sin_start = math.cos(start_heading), math.sin(start_heading)
    cos_end, sin_end = math.cos(end_heading), math.sin(end_heading)
    dx, dy = end[0] - start[0], end[1] - start[1]
    # Lengths from both ends to where their tangents meet.
    ahead = (dx * sin_end - dy * cos_end) / turn
    back = (dx * -sin_start + dy * cos_start) / turn
    share = _handle_share(end_heading - start_heading)
    first = (start[0] + share * ahead * cos_start, start[1] + share * ahead * sin_start)
    second = (end[0] - share * back * cos_end, end[1] - share * back * sin_end)
    return [
        _bezier(start, first, second, end, step / CURVE_POINTS) for step in range(CURVE_POINTS + 1)
    ]


def _handle_share(turn: float) -> float:
    """Return the handle's length over the tangent's, exact for an arc of this turn."""
    angle = abs(math.remainder(turn, 2.0 * math.pi))
    return 4.0 / 3.0 * math.tan(angle / 4.0) / math.tan(angle / 2.0)


def _bezier(p0: Point, p1: Point, p2: Point, p3: Point, t: float) -> Point:
    weights = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3)
    points = (p0, p1, p2, p3)
    x, y = (sum(w * p[axis] for w, p in zip(weights, points, strict=True)) for axis in range(2))
    return x, y
