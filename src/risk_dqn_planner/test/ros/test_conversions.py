# SPDX-License-Identifier: Apache-2.0
"""What goes through a message comes out the same; what is broken is refused by name."""

import math
from dataclasses import replace
from enum import IntEnum

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PolygonStamped
from hypothesis import given
from hypothesis import strategies as st
from intersection_msgs.msg import Decision as DecisionMessage
from intersection_msgs.msg import Explanation as ExplanationMessage
from intersection_msgs.msg import PerceivedObjects, RelevantVehicle
from intersection_msgs.msg import Situation as SituationMessage
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message

from risk_dqn_planner.decision import Action, Decision, Reason, fault_decision
from risk_dqn_planner.errors import InputError
from risk_dqn_planner.explanation.fields import NOTHING_EXPLAINED, Critical, Explanation, Verdict
from risk_dqn_planner.policies.base import Supervision
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.ros.situation_records import read_situation
from risk_dqn_planner.situation.inputs import EgoPose, Perception, object_arrays
from risk_dqn_planner.situation.report import FaultyInput, SituationReport, Status
from risk_dqn_planner.situation.warm_up import example_situation, square

STAMP_NS = 1_234_567_890_123
REPORT = SituationReport(
    stamp_ns=STAMP_NS,
    status=Status.OK,
    text="",
    route=(3476, -2),
    stop_line_derived=True,
    situations=example_situation(),
)
DECISION = Decision(
    action=Action.SLOW,
    target_speed_mps=1.0,
    reason=Reason.VEHICLE,
    text="SLOW: vehicle 17 reaches lane 3 in 2.1 s",
    q_values=np.array([0.5, -0.25, math.nan]),
    action_risks=np.array([0.0, 0.5, 1.0]),
    critical_vehicle_id=17,
    critical_lane_id=None,
    policy_name="rule_based",
    policy_hash="f" * 64,
    explanation=Explanation(
        considered=Action.FAST,
        verdict=Verdict.TOO_LATE,
        critical=Critical.APPROACHING,
        merging=True,
        distance_m=12.5,
        reach_s=2.1,
        margins_s=(math.inf, 0.5, -1.0),
    ),
)


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_stamps_keep_every_nanosecond(time_ns: int) -> None:
    assert conversions.to_ns(conversions.to_stamp(time_ns)) == time_ns


def test_stamps_that_no_clock_shows_become_the_nearest_there_is() -> None:
    latest = Time(sec=2**31 - 1, nanosec=2**32 - 1)
    assert conversions.to_stamp(conversions.to_ns(latest)) == Time(
        sec=2**31 - 1, nanosec=999_999_999
    )
    assert conversions.to_stamp(-(10**20)) == Time(sec=-(2**31), nanosec=0)


@pytest.mark.parametrize(("seconds", "parts"), [(1.25, (1, 250_000_000)), (0.3, (0, 300_000_000))])
def test_durations_are_split_into_seconds_and_nanoseconds(
    seconds: float, parts: tuple[int, int]
) -> None:
    duration = conversions.to_duration(seconds)
    assert (duration.sec, duration.nanosec) == parts


@given(
    st.floats(-1e4, 1e4),
    st.floats(-1e4, 1e4),
    st.floats(-math.pi + 1e-6, math.pi - 1e-6),
    st.floats(-5.0, 30.0),
)
def test_the_ego_survives_the_way_through_odometry(
    x: float, y: float, heading: float, speed: float
) -> None:
    ego = EgoPose(x, y, heading, speed)
    message = conversions.ego_to_message(ego, STAMP_NS)
    assert conversions.ego_from_message(message) == pytest.approx(ego)


def test_odometry_is_in_the_map_and_its_twist_in_the_vehicles_frame() -> None:
    message = conversions.ego_to_message(EgoPose(1.0, 2.0, math.pi / 2, 3.0), STAMP_NS)
    assert (message.header.frame_id, message.child_frame_id) == ("map", "base_link")
    # Facing north at 3 m/s: all of the speed is forward, whatever the heading.
    assert (message.twist.twist.linear.x, message.twist.twist.linear.y) == (3.0, 0.0)
    assert conversions.to_ns(message.header.stamp) == STAMP_NS


def test_the_footprints_centre_may_lie_ahead_of_the_odometrys_frame() -> None:
    message = conversions.ego_to_message(EgoPose(10.0, 5.0, math.pi / 2, 3.0), STAMP_NS)
    assert conversions.ego_from_message(message, 1.4) == pytest.approx((10.0, 6.4, math.pi / 2, 3))


def test_an_orientation_that_was_never_set_is_refused() -> None:
    message = Odometry()
    message.pose.pose.orientation.w = 0.0
    with pytest.raises(InputError, match="odometry: orientation has norm 0, expected 1"):
        conversions.ego_from_message(message)


def test_objects_survive_the_way_over_the_wire() -> None:
    objects = object_arrays([[1.0, 2.0, 0.5, 3.0], [4.0, 5.0, -0.5, 6.0]], [7, -9], (4.5, 1.8))
    message = conversions.objects_to_message(objects, STAMP_NS)
    received = conversions.read_objects.of(message)
    assert received.header == message.header
    for before, after in zip(objects, conversions.objects_from_records(received), strict=True):
        assert after.dtype == before.dtype
        assert after.tolist() == before.tolist()


def test_an_empty_list_of_objects_is_a_list() -> None:
    objects = conversions.objects_from_records(conversions.read_objects.of(PerceivedObjects()))
    assert [len(column) for column in objects] == [0] * 7


def test_a_polygon_keeps_its_corners_to_a_millimetre() -> None:
    area = conversions.area_to_message(square(123.4567), STAMP_NS)
    for corners in (
        conversions.polygon_from_message(area.polygon),
        conversions.corners_from_records(conversions.read_area.of(area)),
    ):
        assert corners == pytest.approx(square(123.4567), abs=1e-3)


def perception(odometry: Odometry, area: PolygonStamped, objects: PerceivedObjects) -> Perception:
    """What messages say together once they have come over the wire."""
    received = conversions.read_area.of(area), conversions.read_objects.of(objects)
    return conversions.perception_from_messages(odometry, *received, "map", 0.0)


def test_a_message_in_another_frame_is_refused() -> None:
    odometry = conversions.ego_to_message(EgoPose(0.0, 0.0, 0.0, 0.0), STAMP_NS)
    area = conversions.area_to_message(square(5.0), STAMP_NS)
    objects = conversions.objects_to_message(object_arrays(), STAMP_NS, frame_id="base_link")
    with pytest.raises(InputError, match="objects: frame is 'base_link', expected 'map'"):
        perception(odometry, area, objects)


def test_a_fault_of_a_message_names_its_kind_and_the_input() -> None:
    odometry = conversions.ego_to_message(EgoPose(0.0, 0.0, 0.0, 0.0), STAMP_NS, "odom")
    with pytest.raises(InputError) as caught:
        conversions.check_frame(odometry.header, "map", FaultyInput.ODOMETRY)
    assert (caught.value.kind, caught.value.source) == (Status.WRONG_FRAME, FaultyInput.ODOMETRY)
    odometry.pose.pose.orientation.w = math.nan
    with pytest.raises(InputError) as caught:
        conversions.ego_from_message(odometry)
    assert (caught.value.kind, caught.value.source) == (Status.NOT_FINITE, FaultyInput.ODOMETRY)


def test_an_older_visible_area_is_known_to_be_older() -> None:
    odometry = conversions.ego_to_message(EgoPose(1.0, 2.0, 0.3, 4.0), STAMP_NS)
    objects = conversions.objects_to_message(object_arrays(), STAMP_NS)
    for older_ns in (0, 300_000_000, -100_000_000):
        area = conversions.area_to_message(square(5.0), STAMP_NS - older_ns)
        seen = perception(odometry, area, objects)
        assert seen.visible_area_age_s == pytest.approx(1e-9 * older_ns)


def test_a_route_survives() -> None:
    message = conversions.route_to_message((3476, 16497, -5), STAMP_NS)
    assert conversions.route_from_message(message) == (3476, 16497, -5)


def over_the_wire(report: SituationReport) -> SituationReport:
    return read(conversions.situation_to_message(report))


def read(message: SituationMessage) -> SituationReport:
    return conversions.situation_from_records(read_situation(bytes(serialize_message(message))))


def test_a_situation_survives_the_way_over_the_wire() -> None:
    received = over_the_wire(REPORT)
    assert replace(received, situations=None) == replace(REPORT, situations=None)
    assert received.situations is not None
    assert REPORT.situations is not None
    assert not received.situations.vehicle_mask[0, 1:].any()
    pairs = zip(REPORT.situations, received.situations, strict=True)
    for name, (before, after) in zip(REPORT.situations._fields, pairs, strict=True):
        assert after.dtype == before.dtype, name
        held = after[:, :1] if name.startswith("vehicle_") else after
        assert held.tolist() == before.tolist(), name


def test_situations_of_a_few_vehicles_more_or_less_have_the_same_shape() -> None:
    message = conversions.situation_to_message(REPORT)
    (vehicle,) = message.vehicles
    places = []
    for count in (0, 1, 15, 16, 17, 32):
        message.vehicles = [vehicle] * count
        received = read(message).situations
        assert received is not None
        assert received.vehicle_mask.sum() == count
        places.append(received.vehicle_mask.shape[1])
    assert places == [16, 16, 16, 16, 32, 32]


def test_a_situation_names_lanes_and_vehicles_by_id() -> None:
    message = conversions.situation_to_message(REPORT)
    assert [lane.lane_id for lane in message.lanes] == [1]
    assert [(v.vehicle_id, v.lane_id, v.distance_m) for v in message.vehicles] == [(1, 1, 30.0)]


def test_a_fault_survives_without_a_situation() -> None:
    fault = SituationReport(
        STAMP_NS, Status.OFF_ROUTE, "3.0 m beside", (4,), source=FaultyInput.ODOMETRY
    )
    message = conversions.situation_to_message(fault)
    assert over_the_wire(fault) == fault
    assert (len(message.lanes), len(message.vehicles)) == (0, 0)


SUPERVISOR = {f"SUPERVISOR_{verdict.name}": int(verdict) for verdict in Supervision}


def codes(*enums: type[IntEnum]) -> dict[str, int]:
    return {member.name: int(member) for each in enums for member in each}


def constants(message: type) -> dict[str, int]:
    """What a message defines: class attributes in capitals are constants."""
    names = [name for name in dir(type(message)) if name.isupper() and not name.startswith("_")]
    return {name: getattr(message, name) for name in names}


def test_the_codes_of_situations_are_those_of_the_message() -> None:
    assert constants(SituationMessage) == codes(Status, FaultyInput)


def test_the_codes_of_decisions_are_those_of_the_message() -> None:
    found = constants(DecisionMessage)
    expected = codes(Action, Reason, FaultyInput) | SUPERVISOR | {"NO_ID": DecisionMessage.NO_ID}
    assert found == expected


def test_the_codes_of_explanations_are_those_of_the_message() -> None:
    expected = codes(Action, Verdict, Critical) | {"NO_ACTION": ExplanationMessage.NO_ACTION}
    assert constants(ExplanationMessage) == expected


def test_every_fault_of_a_situation_is_a_reason_to_stop_with_the_same_name_and_code() -> None:
    faults = {status.name: int(status) for status in Status if status is not Status.OK}
    reasons = {reason.name: int(reason) for reason in Reason if reason.is_fault}
    own = {name: code for name, code in reasons.items() if code >= Reason.POLICY_NOT_READY}
    assert reasons == faults | own
    assert sorted(own) == ["POLICY_FAILED", "POLICY_NOT_READY", "POLICY_REFUSED", "RECOVERING"]


def test_a_situation_with_a_number_that_is_not_finite_is_refused() -> None:
    message = conversions.situation_to_message(REPORT)
    message.lanes[0].hidden_distance_m = math.nan
    with pytest.raises(InputError, match="lane_hidden_distance_m is not finite"):
        read(message)


@pytest.mark.parametrize("value", [0.0, -5.0])
@pytest.mark.parametrize("field", ["ego_zone_m", "zone_m", "speed_limit_mps"])
def test_a_lane_that_would_make_everything_sound_is_refused(field: str, value: float) -> None:
    message = conversions.situation_to_message(REPORT)
    setattr(message.lanes[0], field, value)
    with pytest.raises(InputError, match=f"lane_{field} is {value:g}, expected a number above 0"):
        read(message)


def test_a_vehicle_on_a_lane_that_is_not_listed_is_refused() -> None:
    message = conversions.situation_to_message(REPORT)
    message.vehicles.append(RelevantVehicle(vehicle_id=5, lane_id=99))
    with pytest.raises(InputError, match="vehicle 5 is on lane 99, expected one of \\[1\\]"):
        read(message)


def test_a_lane_that_appears_twice_is_refused() -> None:
    message = conversions.situation_to_message(REPORT)
    message.lanes = [message.lanes[0], message.lanes[0]]
    with pytest.raises(InputError, match="a lane appears twice"):
        read(message)


def test_an_unknown_status_is_refused() -> None:
    with pytest.raises(InputError, match="situation: 77 is not a valid Status"):
        read(SituationMessage(status=77))


def test_a_decision_survives_the_way_over_the_wire() -> None:
    message = conversions.decision_to_message(DECISION, STAMP_NS, STAMP_NS - 250_000_000)
    received = deserialize_message(serialize_message(message), DecisionMessage)
    decision = conversions.decision_from_message(received)
    for name in ("q_values", "action_risks"):
        np.testing.assert_array_equal(getattr(decision, name), getattr(DECISION, name))
    assert replace(decision, q_values=DECISION.q_values, action_risks=DECISION.action_risks) == (
        DECISION
    )
    assert received.situation_age_s == pytest.approx(0.25)
    assert conversions.to_ns(received.situation_stamp) == STAMP_NS - 250_000_000
    assert received.critical_lane_id == DecisionMessage.NO_ID
    assert math.isnan(received.explanation.leave_s)


def test_every_verdict_of_the_supervisor_has_the_code_of_the_message() -> None:
    for verdict in Supervision:
        assert getattr(DecisionMessage, f"SUPERVISOR_{verdict.name}") == verdict


def test_what_was_proposed_survives_the_way_over_the_wire() -> None:
    overruled = replace(DECISION, supervision=Supervision.OVERRULED, proposed=Action.FAST)
    message = conversions.decision_to_message(overruled, STAMP_NS)
    received = deserialize_message(serialize_message(message), DecisionMessage)
    assert received.supervisor == DecisionMessage.SUPERVISOR_OVERRULED
    assert received.proposed == DecisionMessage.FAST
    decision = conversions.decision_from_message(received)
    assert (decision.supervision, decision.proposed) == (Supervision.OVERRULED, Action.FAST)


def test_an_action_that_nobody_checked_is_the_proposed_one() -> None:
    message = conversions.decision_to_message(DECISION, STAMP_NS)
    assert message.supervisor == DecisionMessage.SUPERVISOR_OFF
    assert message.proposed == DecisionMessage.SLOW
    assert conversions.decision_from_message(message).proposed is None


def test_an_unknown_verdict_is_refused() -> None:
    with pytest.raises(InputError, match="decision: 7 is not a valid Supervision"):
        conversions.decision_from_message(DecisionMessage(supervisor=7))


def test_what_is_at_fault_survives_the_way_over_the_wire() -> None:
    fault = replace(DECISION, reason=Reason.STALE_INPUT, faulty_input=FaultyInput.VISIBLE_AREA)
    message = conversions.decision_to_message(fault, STAMP_NS)
    received = deserialize_message(serialize_message(message), DecisionMessage)
    assert received.faulty_input == DecisionMessage.VISIBLE_AREA
    assert conversions.decision_from_message(received).faulty_input is FaultyInput.VISIBLE_AREA


def test_a_decision_without_a_situation_has_a_negative_age() -> None:
    message = conversions.decision_to_message(DECISION, STAMP_NS)
    assert message.situation_age_s < 0.0
    assert conversions.to_ns(message.situation_stamp) == 0


def test_an_unknown_action_is_refused() -> None:
    with pytest.raises(InputError, match="decision: 9 is not a valid Action"):
        conversions.decision_from_message(DecisionMessage(action=9))


def test_a_decision_with_an_unknown_verdict_is_refused() -> None:
    message = conversions.decision_to_message(DECISION, STAMP_NS)
    message.explanation.verdict = 99
    with pytest.raises(InputError, match="decision: 99 is not a valid Verdict"):
        conversions.decision_from_message(message)


def test_a_fault_considers_no_action() -> None:
    fault = fault_decision(Reason.STALE_INPUT, "odometry is old")
    message = conversions.decision_to_message(fault, STAMP_NS)
    assert message.explanation.considered == ExplanationMessage.NO_ACTION
    assert conversions.decision_from_message(message).explanation == NOTHING_EXPLAINED
