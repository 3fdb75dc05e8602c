# SPDX-License-Identifier: Apache-2.0
"""What RViz and Foxglove show: one namespace a concept, everything in the frame of the map.

Markers keep their ids from message to message; what may vanish bears a lifetime.
"""

import math
from collections.abc import Iterator

import numpy as np
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from risk_dqn_planner.decision import Action, Decision
from risk_dqn_planner.geometry.footprint import footprint_corners
from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import ConflictKind, IntersectionModel
from risk_dqn_planner.policies.base import Supervision
from risk_dqn_planner.ros.conversions import header, to_duration
from risk_dqn_planner.situation.inputs import ObjectArrays, Perception
from risk_dqn_planner.situation.report import SituationReport
from risk_dqn_planner.situation.situations import Floats, Situations
from risk_dqn_planner.vehicle import VehicleDimensions

LIFETIME_S = 1.0
_GREY, _BLUE, _GREEN = (0.6, 0.6, 0.6), (0.2, 0.5, 1.0), (0.2, 0.8, 0.3)
_ORANGE, _RED, _WHITE = (1.0, 0.6, 0.1), (0.9, 0.2, 0.2), (1.0, 1.0, 1.0)
_KIND_COLORS = {ConflictKind.CROSSING: _ORANGE, ConflictKind.MERGING: _BLUE}
_ACTION_COLORS = {Action.STOP: _RED, Action.SLOW: _ORANGE, Action.FAST: _GREEN}

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


def situation_markers(
    model: IntersectionModel, report: SituationReport, seen: Perception, frame_id: str
) -> MarkerArray:
    """Return the intersection and what is perceived on it."""
    builder = MarkerBuilder(report.stamp_ns, frame_id)
    _add_model(builder, model)
    size = model.ego_dimensions
    ego = seen.ego
    box = (ego.x_m, ego.y_m, ego.heading_rad, size.length_m, size.width_m)
    builder.boxes("ego", [box], _GREEN)
    closed = np.concatenate([seen.visible_area, seen.visible_area[:1]])
    builder.line("visible_area", closed, _WHITE, alpha=0.5)
    boxes = list(_object_boxes(seen.objects, model.traffic_dimensions))
    builder.boxes("objects", boxes, _GREY)
    if report.situations is not None:
        _add_vehicles(builder, model, report.situations, seen.objects)
        _add_hidden(builder, model, report.situations)
    return builder.message()


def _add_model(builder: MarkerBuilder, model: IntersectionModel) -> None:
    ego = model.ego_path.centerline
    builder.line("ego_path", ego.xy, _GREEN, alpha=0.4)
    front_m = model.stop_line.position_m + 0.5 * model.ego_dimensions.length_m
    builder.line("stop_line", _across(ego, front_m, model.ego_path.half_width_m), _RED, 0.3)
    builder.line("goal", _across(ego, model.goal_m, model.ego_path.half_width_m), _GREEN, 0.3)
    for lane in model.lanes:
        rgb = _KIND_COLORS[lane.kind]
        for conflict in lane.paths:
            line = conflict.path.centerline
            builder.line("lanes", line.xy, rgb, alpha=0.4)
            center, half = conflict.zone_center_m, 0.5 * lane.zone_length_m
            width = 2.0 * conflict.path.half_width_m
            builder.line("zones", _part(line, center - half, center + half), rgb, width, 0.25)


def _across(line: Polyline, s: float, half_width_m: float) -> Floats:
    """Return a line (2, 2) across a path at arc length s."""
    x, y = line.position(s)
    heading = line.heading_at(s)
    left_x, left_y = -half_width_m * math.sin(heading), half_width_m * math.cos(heading)
    return np.array([[x - left_x, y - left_y], [x + left_x, y + left_y]])


def _part(line: Polyline, begin: float, end: float) -> Floats:
    between = line.s[(line.s > begin) & (line.s < end)]
    return np.array([line.position(s) for s in (begin, *between, end)])


def _object_boxes(objects: ObjectArrays, assumed: VehicleDimensions) -> Iterator[Box]:
    rows = zip(*(column.tolist() for column in objects[1:]), strict=True)
    for x, y, heading, _speed, length, width in rows:
        yield x, y, heading, length or assumed.length_m, width or assumed.width_m


def _add_vehicles(
    builder: MarkerBuilder, model: IntersectionModel, given: Situations, objects: ObjectArrays
) -> None:
    """Show which objects matter, and how far they are from which zone."""
    index = {int(number): k for k, number in enumerate(objects.id)}
    boxes = list(_object_boxes(objects, model.traffic_dimensions))
    labels: dict[int, list[str]] = {}
    for k in np.flatnonzero(given.vehicle_mask[0]):
        lane_id = given.lane_id[0, given.vehicle_lane[0, k]]
        text = f"lane {lane_id}: {given.vehicle_distance_m[0, k]:.1f} m"
        labels.setdefault(int(given.vehicle_id[0, k]), []).append(text)
    builder.boxes("vehicles", [boxes[index[number]] for number in labels], _RED)
    for number, lines in labels.items():
        x, y = boxes[index[number]][:2]
        builder.text("vehicle_distances", x, y, "\n".join([f"vehicle {number}", *lines]), _WHITE)


def _add_hidden(builder: MarkerBuilder, model: IntersectionModel, given: Situations) -> None:
    """Show where vehicles are assumed to hide; on each branch of a lane at the lane's distance."""
    boxes: list[Box] = []
    size = model.traffic_dimensions
    for k, lane in enumerate(model.lanes):
        distance = float(given.lane_hidden_distance_m[0, k])
        for conflict in lane.paths:
            line = conflict.path.centerline
            s = conflict.zone_center_m - distance
            x, y = line.position(s)
            boxes.append((x, y, line.heading_at(s), size.length_m, size.width_m))
            builder.text("hidden_distances", x, y, f"hidden {distance:.1f} m", _BLUE)
    builder.boxes("hidden", boxes, _BLUE)


def decision_markers(decision: Decision, stamp_ns: int, frame_id: str) -> MarkerArray:
    """Return the decision with its reason as a text at the origin of a frame.

    Where a supervisor ran, its verdict is the second line.
    """
    builder = MarkerBuilder(stamp_ns, frame_id)
    lines = [decision.text]
    if decision.supervision is not Supervision.OFF:
        lines.append(f"supervisor: {decision.supervision.name}")
    builder.text("decision", 0.0, 0.0, "\n".join(lines), _ACTION_COLORS[decision.action])
    return builder.message()
