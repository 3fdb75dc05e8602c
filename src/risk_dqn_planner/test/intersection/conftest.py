# SPDX-License-Identifier: Apache-2.0
"""Small Lanelet2 maps for tests, drawn in metres and written to a file like any other map."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lanelet2
import pytest
from lanelet2.core import AttributeMap, Lanelet, LaneletMap, LineString3d, Point3d

from risk_dqn_planner.map.loader import MapOrigin, RoadMap, load_map

ORIGIN = MapOrigin(49.0, 8.4)
WIDTH_M = 3.5
SNAP_M = 0.1

Point = tuple[float, float]
# lanelet2's Python objects carry no types.
MapLanelet = Any
MapLine = Any
MapPoint = Any


class Sketch:
    """Lanelets about centrelines; borders share points where lanelets follow one another."""

    def __init__(self, turn_rad: float = 0.0, offset: Point = (0.0, 0.0)) -> None:
        self.lanelet_map = LaneletMap()
        self._turn = turn_rad
        self._offset = offset
        self._points: dict[tuple[float, float, float], MapPoint] = {}
        self._next_id = 1000

    def lane(
        self,
        lane_id: int,
        centerline: Sequence[Point],
        width_m: float = WIDTH_M,
        height_m: float = 0.0,
        **attributes: str,
    ) -> MapLanelet:
        """Add a lanelet with `width_m` about a centreline; speed_limit="10 km/h" and the like."""
        left = self._line(_beside(centerline, 0.5 * width_m), height_m)
        right = self._line(_beside(centerline, -0.5 * width_m), height_m)
        lanelet = Lanelet(lane_id, left, right)
        tags = {"subtype": "road", "location": "urban", "one_way": "yes", **attributes}
        for key, value in tags.items():
            lanelet.attributes[key] = value
        self.lanelet_map.add(lanelet)
        return lanelet

    def line(self, line_id: int, points: Sequence[Point], kind: str) -> MapLine:
        """Add a linestring such as a stop line."""
        line = self._line(points, 0.0, line_id)
        line.attributes["type"] = kind
        self.lanelet_map.add(line)
        return line

    def right_of_way(
        self,
        rule_id: int,
        yielding: MapLanelet,
        priority: MapLanelet,
        line: MapLine,
        *,
        listed: bool,
    ) -> None:
        """Let a lanelet give way at a line; the lanelet itself may or may not list the rule."""
        rule = lanelet2.core.RightOfWay(rule_id, AttributeMap({}), [priority], [yielding], line)
        if listed:
            yielding.addRegulatoryElement(rule)
        self.lanelet_map.add(rule)

    def load(self, folder: Path) -> RoadMap:
        """Write the map and load it as the planner does."""
        path = folder / "map.osm"
        anchor = lanelet2.io.Origin(ORIGIN.latitude_deg, ORIGIN.longitude_deg)
        projector = lanelet2.projection.UtmProjector(anchor)
        lanelet2.io.write(str(path), self.lanelet_map, projector)
        return load_map(path, ORIGIN)

    def _line(
        self, points: Sequence[Point], height_m: float, line_id: int | None = None
    ) -> MapLine:
        drawn = [self._point(point, height_m) for point in points]
        self._next_id += 1
        return LineString3d(line_id or self._next_id, drawn)

    def _point(self, point: Point, height_m: float) -> MapPoint:
        # Ends of bends that were drawn with chords meet their neighbours' only nearly.
        for (x, y, z), drawn in self._points.items():
            if z == height_m and math.dist((x, y), point) < SNAP_M:
                return drawn
        cos, sin = math.cos(self._turn), math.sin(self._turn)
        x = point[0] * cos - point[1] * sin + self._offset[0]
        y = point[0] * sin + point[1] * cos + self._offset[1]
        self._next_id += 1
        self._points[(*point, height_m)] = Point3d(self._next_id, x, y, height_m)
        return self._points[(*point, height_m)]


def _beside(points: Sequence[Point], aside_m: float) -> list[Point]:
    """Shift a line sideways (left positive), mitred at its corners."""
    shifted = []
    for index, (x, y) in enumerate(points):
        before = points[max(index - 1, 0)]
        after = points[min(index + 1, len(points) - 1)]
        headings = [
            math.atan2(b[1] - a[1], b[0] - a[0])
            for a, b in ((before, (x, y)), ((x, y), after))
            if a != b
        ]
        half_turn = 0.5 * math.remainder(headings[-1] - headings[0], 2.0 * math.pi)
        normal = headings[0] + half_turn + 0.5 * math.pi
        reach = aside_m / math.cos(half_turn)
        shifted.append((x + reach * math.cos(normal), y + reach * math.sin(normal)))
    return shifted


@pytest.fixture(scope="session")
def sketch() -> Callable[..., Sketch]:
    return Sketch
