# SPDX-License-Identifier: Apache-2.0
"""Puts markers for RViz and Foxglove together, numbered within their namespaces.

Markers keep their ids from message to message; what may vanish bears a lifetime, or is deleted.
"""

from itertools import pairwise

from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from risk_dqn_planner.geometry.footprint import footprint_corners
from risk_dqn_planner.ros.conversions import header, to_duration
from risk_dqn_planner.situation.situations import Floats

LIFETIME_S = 1.0
GREY, BLUE, GREEN = (0.6, 0.6, 0.6), (0.2, 0.5, 1.0), (0.2, 0.8, 0.3)
ORANGE, RED, WHITE = (1.0, 0.6, 0.1), (0.9, 0.2, 0.2), (1.0, 1.0, 1.0)

Rgb = tuple[float, float, float]
Box = tuple[float, float, float, float, float]  # x, y, heading, length, width


class MarkerBuilder:
    """Collects the markers of one message, numbering them within each namespace."""

    def __init__(self, stamp_ns: int, frame_id: str) -> None:
        self._stamp_ns = stamp_ns
        self._frame_id = frame_id
        self._markers: list[Marker] = []
        self._counts: dict[str, int] = {}

    def message(self) -> MarkerArray:
        """Return everything added."""
        return MarkerArray(markers=self._markers)

    def line(
        self, namespace: str, points: Floats, rgb: Rgb, width_m: float = 0.15, alpha: float = 0.8
    ) -> None:
        """Add a line through points (K, 2)."""
        marker = self._add(namespace, Marker.LINE_STRIP, rgb, alpha)
        marker.scale.x = width_m
        marker.points = [_point(x, y) for x, y in points.tolist()]

    def lines(self, namespace: str, parts: list[Floats], rgb: Rgb, width_m: float) -> None:
        """Add lines through points (K, 2) as one marker; none at all deletes it."""
        marker = self._add(namespace, Marker.LINE_LIST, rgb, 0.6)
        marker.scale.x = width_m
        if not parts:
            marker.action = Marker.DELETE
        for points in parts:
            corners = [_point(x, y) for x, y in points.tolist()]
            for begin, end in pairwise(corners):
                marker.points += [begin, end]

    def boxes(self, namespace: str, boxes: list[Box], rgb: Rgb) -> None:
        """Add the outlines of vehicles as one marker; none at all deletes it."""
        marker = self._add(namespace, Marker.LINE_LIST, rgb, 1.0)
        marker.scale.x = 0.15
        if not boxes:
            marker.action = Marker.DELETE
        for box in boxes:
            corners = [_point(x, y) for x, y in footprint_corners(*box).tolist()]
            for k in range(4):
                marker.points += [corners[k], corners[(k + 1) % 4]]

    def areas(self, namespace: str, boxes: list[Box], colors: list[Rgb]) -> None:
        """Fill the footprints of vehicles as one marker, each in its colour; none deletes it."""
        marker = self._add(namespace, Marker.TRIANGLE_LIST, WHITE, 0.7)
        marker.scale.x = marker.scale.y = marker.scale.z = 1.0
        if not boxes:
            marker.action = Marker.DELETE
        for box, rgb in zip(boxes, colors, strict=True):
            corners = [_point(x, y) for x, y in footprint_corners(*box).tolist()]
            marker.points += [corners[k] for k in (0, 1, 2, 0, 2, 3)]
            marker.colors += [ColorRGBA(r=rgb[0], g=rgb[1], b=rgb[2], a=0.7)] * 6

    def text(self, namespace: str, x: float, y: float, text: str, rgb: Rgb) -> None:
        """Add a text that vanishes unless it is sent again."""
        marker = self._add(namespace, Marker.TEXT_VIEW_FACING, rgb, 1.0)
        marker.pose.position = _point(x, y, 2.0)
        marker.scale.z = 1.2
        marker.text = text
        marker.lifetime = to_duration(LIFETIME_S)

    def _add(self, namespace: str, kind: int, rgb: Rgb, alpha: float) -> Marker:
        number = self._counts.get(namespace, 0)
        self._counts[namespace] = number + 1
        marker = Marker(
            header=header(self._stamp_ns, self._frame_id),
            ns=namespace,
            id=number,
            type=kind,
            action=Marker.ADD,
            color=ColorRGBA(r=rgb[0], g=rgb[1], b=rgb[2], a=alpha),
        )
        marker.pose.orientation.w = 1.0
        self._markers.append(marker)
        return marker


def _point(x: float, y: float, z: float = 0.0) -> Point:
    return Point(x=float(x), y=float(y), z=z)
