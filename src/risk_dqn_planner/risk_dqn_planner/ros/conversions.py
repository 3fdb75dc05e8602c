# SPDX-License-Identifier: Apache-2.0
"""Between messages and the core's types.

Fields are touched here, in situation_records.py, which reads long messages, and in explanations.py.

Nothing is trusted: what comes in is checked for finite numbers here or, where the core looks at
it anyway (ego, objects, visible area), there. A violation raises InputError.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point32, Polygon, PolygonStamped
from intersection_msgs.msg import Decision as DecisionMessage
from intersection_msgs.msg import (
    IntersectingLane,
    PerceivedObject,
    PerceivedObjects,
    RelevantVehicle,
    Route,
)
from intersection_msgs.msg import Situation as SituationMessage
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

from risk_dqn_planner.decision import Action, Decision, Reason
from risk_dqn_planner.errors import InputError
from risk_dqn_planner.faults import FaultyInput, Status
from risk_dqn_planner.policies.base import Supervision
from risk_dqn_planner.ros.explanations import explanation_from_message, explanation_to_message
from risk_dqn_planner.ros.records import RecordList, RecordReader
from risk_dqn_planner.ros.situation_records import SituationRecords
from risk_dqn_planner.ros.streams import SECOND_NS
from risk_dqn_planner.situation.inputs import EgoPose, ObjectArrays, Perception
from risk_dqn_planner.situation.report import SituationReport
from risk_dqn_planner.situation.situations import Floats, Situations, empty_situations

_FIRST_NS, _LAST_NS = -(2**31) * SECOND_NS, 2**31 * SECOND_NS - 1
# Orientations of drivers and simulators are normalised; an unset one has norm 0.
_QUATERNION_NORM_TOLERANCE = 0.1
# Situations have places for a multiple of so many.
_VEHICLES_AT_ONCE = 16

read_area = RecordReader(Point32)
read_objects = RecordReader(PerceivedObject)


def to_ns(stamp: Time) -> int:
    """Return a stamp as nanoseconds."""
    return int(stamp.sec) * SECOND_NS + int(stamp.nanosec)


def to_stamp(time_ns: int) -> Time:
    """Return nanoseconds as a stamp, the nearest there is.

    Stamps that come in may hold billions of nanoseconds on top of the last second there is.
    """
    seconds, nanoseconds = divmod(min(max(time_ns, _FIRST_NS), _LAST_NS), SECOND_NS)
    return Time(sec=seconds, nanosec=nanoseconds)


def to_duration(seconds: float) -> Duration:
    """Return a length of time."""
    whole, nanoseconds = divmod(round(seconds * SECOND_NS), SECOND_NS)
    return Duration(sec=whole, nanosec=nanoseconds)


def header(stamp_ns: int, frame_id: str = "") -> Header:
    """Return a header."""
    return Header(stamp=to_stamp(stamp_ns), frame_id=frame_id)


def check_frame(given: Header, frame_id: str, source: FaultyInput) -> None:
    """Raise InputError unless a message's coordinates are in the expected frame."""
    if given.frame_id != frame_id:
        text = f"{source}: frame is {given.frame_id!r}, expected {frame_id!r}"
        raise InputError(text, Status.WRONG_FRAME, source)


def ego_from_message(message: Odometry, base_to_center_m: float = 0.0) -> EgoPose:
    """Return the ego's footprint centre, `base_to_center_m` ahead of the odometry's child frame.

    Raises:
        InputError: the orientation is no rotation. Other fields are checked by the core.
    """
    q = message.pose.pose.orientation
    norm = math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)
    if not abs(norm - 1.0) <= _QUATERNION_NORM_TOLERANCE:
        text = f"odometry: orientation has norm {norm:g}, expected 1"
        kind = Status.MALFORMED_INPUT if math.isfinite(norm) else Status.NOT_FINITE
        raise InputError(text, kind, FaultyInput.ODOMETRY)
    heading = math.atan2(
        2.0 * (q.w * q.z + q.x * q.y), q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z
    )
    position = message.pose.pose.position
    return EgoPose(
        position.x + base_to_center_m * math.cos(heading),
        position.y + base_to_center_m * math.sin(heading),
        heading,
        message.twist.twist.linear.x,
    )


def ego_to_message(
    ego: EgoPose, stamp_ns: int, frame_id: str = "map", child_frame_id: str = "base_link"
) -> Odometry:
    """Return the ego's pose in `frame_id` and its twist in `child_frame_id`."""
    message = Odometry(header=header(stamp_ns, frame_id), child_frame_id=child_frame_id)
    message.pose.pose.position.x = float(ego.x_m)
    message.pose.pose.position.y = float(ego.y_m)
    message.pose.pose.orientation.z = math.sin(0.5 * ego.heading_rad)
    message.pose.pose.orientation.w = math.cos(0.5 * ego.heading_rad)
    message.twist.twist.linear.x = float(ego.speed_mps)
    return message


def objects_from_records(message: RecordList) -> ObjectArrays:
    """Return a list of PerceivedObject as arrays; the core checks them."""
    _, *numbers = ObjectArrays._fields
    columns = (message.column(name) for name in numbers)
    return ObjectArrays(message.column("id", np.int64), *columns)


def objects_to_message(
    objects: ObjectArrays, stamp_ns: int, frame_id: str = "map"
) -> PerceivedObjects:
    """Return arrays as a list of objects."""
    rows = zip(*(column.tolist() for column in objects), strict=True)
    return PerceivedObjects(
        header=header(stamp_ns, frame_id),
        objects=[
            PerceivedObject(
                id=number,
                x_m=x,
                y_m=y,
                heading_rad=heading,
                speed_mps=speed,
                length_m=length,
                width_m=width,
            )
            for number, x, y, heading, speed, length, width in rows
        ],
    )


def polygon_from_message(polygon: Polygon) -> Floats:
    """Return the corners (K, 2)."""
    points = [(point.x, point.y) for point in polygon.points]
    return np.array(points, dtype=np.float64).reshape(-1, 2)


def corners_from_records(message: RecordList) -> Floats:
    """Return a list of Point32 as corners (K, 2); the core checks them."""
    return np.column_stack((message.column("x"), message.column("y")))


def polygon_to_message(corners: Floats) -> Polygon:
    """Return corners (K, 2) as a polygon in the plane."""
    return Polygon(points=[Point32(x=x, y=y) for x, y in corners.tolist()])


def area_to_message(corners: Floats, stamp_ns: int, frame_id: str = "map") -> PolygonStamped:
    """Return a visible area with its time."""
    return PolygonStamped(header=header(stamp_ns, frame_id), polygon=polygon_to_message(corners))


def perception_from_messages(
    odometry: Odometry,
    visible_area: RecordList,
    objects: Any,  # noqa: ANN401 (of whichever stack)
    frame_id: str,
    base_to_center_m: float,
    objects_of: Callable[[Any], ObjectArrays] = objects_from_records,
) -> Perception:
    """Return what three messages say together; `objects_of` converts the objects' message.

    Raises:
        InputError: one of them is not in the frame, or an orientation is no rotation.
    """
    check_frame(odometry.header, frame_id, FaultyInput.ODOMETRY)
    check_frame(visible_area.header, frame_id, FaultyInput.VISIBLE_AREA)
    check_frame(objects.header, frame_id, FaultyInput.OBJECTS)
    age_ns = to_ns(objects.header.stamp) - to_ns(visible_area.header.stamp)
    return Perception(
        ego_from_message(odometry, base_to_center_m),
        objects_of(objects),
        corners_from_records(visible_area),
        1e-9 * age_ns,
    )


def route_from_message(message: Route) -> tuple[int, ...]:
    """Return the ids of the lanelets."""
    return tuple(int(lanelet_id) for lanelet_id in message.lanelet_ids)


def route_to_message(route: Sequence[int], stamp_ns: int, frame_id: str = "map") -> Route:
    """Return a route with its time."""
    return Route(header=header(stamp_ns, frame_id), lanelet_ids=list(route))


def situation_to_message(report: SituationReport, frame_id: str = "map") -> SituationMessage:
    """Return a report; on a fault everything behind the text stays empty."""
    message = SituationMessage(
        header=header(report.stamp_ns, frame_id),
        status=int(report.status),
        faulty_input=int(report.source),
        status_text=report.text,
        route=list(report.route),
        route_stamp=to_stamp(report.route_stamp_ns),
    )
    if report.situations is not None:
        _fill_situation(message, report.situations)
        message.stop_line_derived = report.stop_line_derived
    return message


def _fill_situation(message: SituationMessage, given: Situations) -> None:
    message.stop_line_distance_m = float(given.stop_line_distance_m[0])
    message.goal_distance_m = float(given.goal_distance_m[0])
    message.ego_speed_mps = float(given.ego_speed_mps[0])
    message.lanes = [
        IntersectingLane(
            lane_id=int(given.lane_id[0, k]),
            kind=IntersectingLane.MERGING
            if given.lane_merging[0, k]
            else IntersectingLane.CROSSING,
            ego_distance_m=float(given.lane_ego_distance_m[0, k]),
            ego_zone_m=float(given.lane_ego_zone_m[0, k]),
            zone_m=float(given.lane_zone_m[0, k]),
            hidden_distance_m=float(given.lane_hidden_distance_m[0, k]),
            speed_limit_mps=float(given.lane_speed_limit_mps[0, k]),
        )
        for k in np.flatnonzero(given.lane_mask[0])
    ]
    message.vehicles = [
        RelevantVehicle(
            vehicle_id=int(given.vehicle_id[0, k]),
            lane_id=int(given.lane_id[0, given.vehicle_lane[0, k]]),
            distance_m=float(given.vehicle_distance_m[0, k]),
            speed_mps=float(given.vehicle_speed_mps[0, k]),
        )
        for k in np.flatnonzero(given.vehicle_mask[0])
    ]


def situation_from_records(message: SituationRecords) -> SituationReport:
    """Return what the situation node reports.

    Raises:
        InputError: unknown status or faulty input, a number that is not finite, a zone or a speed
            limit that is not above 0, a lane that appears twice or a vehicle on a lane that is
            not listed.
    """
    try:
        status, source = Status(message.status), FaultyInput(message.faulty_input)
    except ValueError as error:
        raise _bad_situation(str(error)) from error
    return SituationReport(
        stamp_ns=to_ns(message.header.stamp),
        status=status,
        source=source,
        text=message.status_text,
        route=tuple(message.route.tolist()),
        route_stamp_ns=to_ns(message.route_stamp),
        stop_line_derived=message.stop_line_derived,
        situations=_read_situation(message) if status is Status.OK else None,
    )


def _read_situation(message: SituationRecords) -> Situations:
    lanes, vehicles = message.lanes, message.vehicles
    index = {lane_id: k for k, lane_id in enumerate(lanes["lane_id"].tolist())}
    if len(index) < len(lanes):
        raise _bad_situation("a lane appears twice")
    on_lanes = [index.get(lane_id, -1) for lane_id in vehicles["lane_id"].tolist()]
    if -1 in on_lanes:
        vehicle = vehicles[on_lanes.index(-1)]
        raise _bad_situation(
            f"vehicle {vehicle['vehicle_id']} is on lane {vehicle['lane_id']}, "
            f"expected one of {sorted(index)}"
        )
    n, m = len(vehicles), len(lanes)
    # Nobody has to think of arrays without entries; and their number seldom changes, so that what
    # a policy has made ready for it fits the next time too.
    places = _VEHICLES_AT_ONCE * max(math.ceil(n / _VEHICLES_AT_ONCE), 1)
    filled = empty_situations(1, places, max(m, 1))
    filled.stop_line_distance_m[0] = message.stop_line_distance_m
    filled.goal_distance_m[0] = message.goal_distance_m
    filled.ego_speed_mps[0] = message.ego_speed_mps
    filled.lane_mask[0, :m] = True
    filled.lane_id[0, :m] = lanes["lane_id"]
    filled.lane_merging[0, :m] = lanes["kind"] == IntersectingLane.MERGING
    filled.lane_ego_distance_m[0, :m] = lanes["ego_distance_m"]
    filled.lane_ego_zone_m[0, :m] = lanes["ego_zone_m"]
    filled.lane_zone_m[0, :m] = lanes["zone_m"]
    filled.lane_hidden_distance_m[0, :m] = lanes["hidden_distance_m"]
    filled.lane_speed_limit_mps[0, :m] = lanes["speed_limit_mps"]
    filled.vehicle_mask[0, :n] = True
    filled.vehicle_id[0, :n] = vehicles["vehicle_id"]
    filled.vehicle_lane[0, :n] = on_lanes
    filled.vehicle_distance_m[0, :n] = vehicles["distance_m"]
    filled.vehicle_speed_mps[0, :n] = vehicles["speed_mps"]
    # All fields at once: one after the other they take longer than everything else here.
    if not np.isfinite(np.concatenate(filled, axis=None)).all():
        named = zip(filled._fields, filled, strict=True)
        name = next(name for name, values in named if not np.isfinite(values).all())
        raise _bad_situation(f"{name} is not finite", Status.NOT_FINITE)
    # Zones of no length and lanes on which nobody can move would make every action sound.
    for name in ("lane_ego_zone_m", "lane_zone_m", "lane_speed_limit_mps"):
        least = getattr(filled, name)[0, :m].min(initial=math.inf)
        if least <= 0.0:
            raise _bad_situation(f"{name} is {least:g}, expected a number above 0")
    return filled


def _bad_situation(text: str, kind: Status = Status.MALFORMED_INPUT) -> InputError:
    return InputError(f"situation: {text}", kind, FaultyInput.SITUATION)


def decision_to_message(
    decision: Decision,
    stamp_ns: int,
    situation_stamp_ns: int | None = None,
    frame_id: str = "map",
) -> DecisionMessage:
    """Return a decision taken at `stamp_ns` on the situation of `situation_stamp_ns`, if any."""
    stamp, age_s = Time(), -1.0
    if situation_stamp_ns is not None:
        stamp = to_stamp(situation_stamp_ns)
        age_s = max(stamp_ns - situation_stamp_ns, 0) / SECOND_NS
    return DecisionMessage(
        header=header(stamp_ns, frame_id),
        action=int(decision.action),
        target_speed_mps=float(decision.target_speed_mps),
        reason=int(decision.reason),
        faulty_input=int(decision.faulty_input),
        text=decision.text,
        q_values=np.asarray(decision.q_values, dtype=np.float64),
        action_risks=np.asarray(decision.action_risks, dtype=np.float64),
        critical_vehicle_id=_id_to_message(decision.critical_vehicle_id),
        critical_lane_id=_id_to_message(decision.critical_lane_id),
        explanation=explanation_to_message(decision.explanation),
        supervisor=int(decision.supervision),
        proposed=int(decision.action if decision.proposed is None else decision.proposed),
        policy_name=decision.policy_name,
        policy_hash=decision.policy_hash,
        situation_stamp=stamp,
        situation_age_s=age_s,
    )


def decision_from_message(message: DecisionMessage) -> Decision:
    """Return the decision; its times stay in the message.

    Raises:
        InputError: a code is unknown, of its action, reason, faulty input, supervisor or
            explanation.
    """
    try:
        action, reason = Action(message.action), Reason(message.reason)
        supervision, proposed = Supervision(message.supervisor), Action(message.proposed)
        faulty_input = FaultyInput(message.faulty_input)
        explanation = explanation_from_message(message.explanation)
    except ValueError as error:
        raise InputError(f"decision: {error}") from error
    return Decision(
        action=action,
        target_speed_mps=message.target_speed_mps,
        reason=reason,
        faulty_input=faulty_input,
        text=message.text,
        q_values=np.array(message.q_values, dtype=np.float64),
        action_risks=np.array(message.action_risks, dtype=np.float64),
        critical_vehicle_id=_id_from_message(message.critical_vehicle_id),
        critical_lane_id=_id_from_message(message.critical_lane_id),
        policy_name=message.policy_name,
        policy_hash=message.policy_hash,
        explanation=explanation,
        supervision=supervision,
        proposed=None if supervision is Supervision.OFF else proposed,
    )


def _id_to_message(identity: int | None) -> int:
    return DecisionMessage.NO_ID if identity is None else int(identity)


def _id_from_message(identity: int) -> int | None:
    return None if identity == DecisionMessage.NO_ID else int(identity)
