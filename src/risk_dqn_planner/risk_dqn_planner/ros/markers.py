# SPDX-License-Identifier: Apache-2.0
"""What RViz and Foxglove show: one namespace a concept, everything in the frame of the map."""

import math
import textwrap
from collections.abc import Iterator, Sequence

import numpy as np
from visualization_msgs.msg import MarkerArray

from risk_dqn_planner.decision import Action, Decision
from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import ConflictKind, IntersectionModel
from risk_dqn_planner.policies.base import Supervision
from risk_dqn_planner.risk.risk import RiskConfig, assess
from risk_dqn_planner.ros.marker_builder import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    WHITE,
    Box,
    MarkerBuilder,
    Rgb,
)
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.inputs import EgoPose, ObjectArrays, Perception, object_arrays
from risk_dqn_planner.situation.report import SituationReport, Status
from risk_dqn_planner.situation.situations import Floats, Situations
from risk_dqn_planner.situation.warm_up import crossing_model, square
from risk_dqn_planner.vehicle import VehicleDimensions

_KIND_COLORS = {ConflictKind.CROSSING: ORANGE, ConflictKind.MERGING: BLUE}
_ACTION_COLORS = {Action.STOP: RED, Action.SLOW: ORANGE, Action.FAST: GREEN}
_TEXT_LETTERS = 56

# Of each path of a lane: nearest and furthest distance to the zone's centre [m].
Places = Sequence[Sequence[tuple[float, float]]]


def situation_markers(
    model: IntersectionModel,
    report: SituationReport,
    seen: Perception,
    frame_id: str,
    hidden_places: Places = (),
) -> MarkerArray:
    """Return the intersection and what is perceived on it.

    hidden_places: where a memory of hidden space says that vehicles may be, for each path of each
    lane in the model's order; empty without such a memory.
    """
    builder = MarkerBuilder(report.stamp_ns, frame_id)
    _add_model(builder, model)
    size = model.ego_dimensions
    ego = seen.ego
    box = (ego.x_m, ego.y_m, ego.heading_rad, size.length_m, size.width_m)
    builder.boxes("ego", [box], GREEN)
    closed = np.concatenate([seen.visible_area, seen.visible_area[:1]])
    builder.line("visible_area", closed, WHITE, alpha=0.5)
    boxes = list(_object_boxes(seen.objects, model.traffic_dimensions))
    builder.boxes("objects", boxes, GREY)
    if report.situations is not None:
        risk = assess(report.situations, RiskConfig(), include_hidden=True)
        _add_vehicles(builder, model, report.situations, seen.objects, 0.0 - risk.vehicle_reward[0])
        _add_hidden(builder, model, report.situations, 0.0 - risk.lane_reward[0])
        _add_places(builder, model, hidden_places)
    return builder.message()


def warm_up() -> None:
    """Compile what markers need, so that no situation waits for it when somebody looks."""
    seen = Perception(EgoPose(-20.0, 0.0, 0.0, 4.0), object_arrays([]), square(40.0))
    situations = SituationBuilder(crossing_model()).build(*seen)
    report = SituationReport(0, Status.OK, "", situations=situations)
    situation_markers(crossing_model(), report, seen, "map")


def _add_model(builder: MarkerBuilder, model: IntersectionModel) -> None:
    ego = model.ego_path.centerline
    builder.line("ego_path", ego.xy, GREEN, alpha=0.4)
    front_m = model.stop_line.position_m + 0.5 * model.ego_dimensions.length_m
    builder.line("stop_line", _across(ego, front_m, model.ego_path.half_width_m), RED, 0.3)
    builder.line("goal", _across(ego, model.goal_m, model.ego_path.half_width_m), GREEN, 0.3)
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
    builder: MarkerBuilder,
    model: IntersectionModel,
    given: Situations,
    objects: ObjectArrays,
    risks: Floats,
) -> None:
    """Show which objects matter, how far they are from which zone, and R_risk of each (N,)."""
    index = {int(number): k for k, number in enumerate(objects.id)}
    boxes = list(_object_boxes(objects, model.traffic_dimensions))
    labels: dict[int, list[str]] = {}
    highest: dict[int, float] = {}
    for k in np.flatnonzero(given.vehicle_mask[0]):
        number, lane_id = int(given.vehicle_id[0, k]), given.lane_id[0, given.vehicle_lane[0, k]]
        text = (
            f"lane {lane_id}: {given.vehicle_distance_m[0, k]:.1f} m, "
            f"{given.vehicle_speed_mps[0, k]:.1f} m/s"
        )
        labels.setdefault(number, []).append(text)
        highest[number] = max(highest.get(number, 0.0), float(risks[k]))
    builder.boxes("vehicles", [boxes[index[number]] for number in labels], RED)
    shown = [boxes[index[number]] for number in highest]
    _add_risks(builder, "vehicle_risks", shown, list(highest.values()))
    for number, lines in labels.items():
        x, y = boxes[index[number]][:2]
        builder.text("vehicle_distances", x, y, "\n".join([f"vehicle {number}", *lines]), WHITE)


def _add_risks(
    builder: MarkerBuilder, namespace: str, boxes: list[Box], risks: list[float]
) -> None:
    """Fill footprints from green, safe, to red, fully unsafe, and write the risk beside them."""
    builder.areas(namespace, boxes, [_risk_color(risk) for risk in risks])
    for (x, y, _, length_m, _), risk in zip(boxes, risks, strict=True):
        builder.text(namespace, x, y - 0.75 * length_m, f"risk {risk:.2f}", _risk_color(risk))


def _risk_color(risk: float) -> Rgb:
    red, green, blue = (risk * r + (1.0 - risk) * g for r, g in zip(RED, GREEN, strict=True))
    return red, green, blue


def _add_hidden(
    builder: MarkerBuilder, model: IntersectionModel, given: Situations, risks: Floats
) -> None:
    """Show where vehicles are assumed to hide, with their R_risk (M,).

    On each branch of a lane at the lane's distance.
    """
    boxes: list[Box] = []
    shown: list[float] = []
    size = model.traffic_dimensions
    for k, lane in enumerate(model.lanes):
        distance = float(given.lane_hidden_distance_m[0, k])
        for conflict in lane.paths:
            line = conflict.path.centerline
            s = conflict.zone_center_m - distance
            x, y = line.position(s)
            boxes.append((x, y, line.heading_at(s), size.length_m, size.width_m))
            shown.append(float(risks[k]))
            builder.text("hidden_distances", x, y, f"hidden {distance:.1f} m", BLUE)
    builder.boxes("hidden", boxes, BLUE)
    _add_risks(builder, "hidden_risks", boxes, shown)


def _add_places(builder: MarkerBuilder, model: IntersectionModel, places: Places) -> None:
    """Show all places that a memory says may hide a vehicle."""
    paths = [conflict for lane in model.lanes for conflict in lane.paths]
    parts = [
        _part(path.path.centerline, path.zone_center_m - far, path.zone_center_m - near)
        for path, intervals in zip(paths, places, strict=False)
        for near, far in intervals
    ]
    builder.lines("hidden_places", parts, BLUE, width_m=1.5)


def decision_markers(decision: Decision, stamp_ns: int, frame_id: str) -> MarkerArray:
    """Return the decision with its reason as a text at the origin of a frame.

    Where a supervisor ran, its verdict is the second line.
    """
    builder = MarkerBuilder(stamp_ns, frame_id)
    lines = textwrap.wrap(decision.text, _TEXT_LETTERS)
    if decision.supervision is not Supervision.OFF:
        lines.append(f"supervisor: {decision.supervision.name}")
    builder.text("decision", 0.0, 0.0, "\n".join(lines), _ACTION_COLORS[decision.action])
    return builder.message()
