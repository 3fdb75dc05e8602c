# SPDX-License-Identifier: Apache-2.0
"""Whatever stands in messages, no input is an internal error, and no decision is missing."""

import math
from typing import Any, TypeAlias

import numpy as np
import pytest
from geometry_msgs.msg import Point32, PolygonStamped
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from intersection_msgs.msg import (
    IntersectingLane,
    PerceivedObject,
    PerceivedObjects,
    RelevantVehicle,
    Situation,
)
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message

from risk_dqn_planner.decision import Action, explain
from risk_dqn_planner.errors import DisconnectedRouteError, InputError
from risk_dqn_planner.faults import FaultyInput, Status
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.policies.base import Policy
from risk_dqn_planner.policies.supervised import SupervisorMode
from risk_dqn_planner.policies.supervised_loading import load_supervised
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.ros.adapters.kinds import ObjectsAdapter
from risk_dqn_planner.ros.decider import Decider, DeciderConfig
from risk_dqn_planner.ros.evaluation import Evaluation
from risk_dqn_planner.ros.parameters import EgoParameters, MapParameters
from risk_dqn_planner.ros.situation_records import SituationRecords, read_situation
from risk_dqn_planner.ros.synchroniser import Frame
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.inputs import object_arrays
from risk_dqn_planner.situation.pipeline import SituationPipeline
from risk_dqn_planner.situation.plausibility import Plausibility
from risk_dqn_planner.situation.report import SituationReport
from risk_dqn_planner.situation.warm_up import crossing_model, square


def drawn(examples: int) -> settings:
    return settings(
        max_examples=examples,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        derandomize=True,
    )


MS = 1_000_000
Message: TypeAlias = Any  # of whichever type
POLICIES: dict[str, Policy] = {}

EDGES = (0.0, -0.0, 1.0, -1.0, 5e-324, 1e-9, 1e9, 1e19, 1e154, 1e300, -1e300, math.nan, math.inf)
near = st.floats(-80.0, 80.0)
number = st.one_of(near, near, near, st.sampled_from(EDGES), st.floats())
finite = st.one_of(near, st.sampled_from(EDGES[:11]))
number_32 = st.one_of(near, near, near, st.sampled_from((3e38, -3e38, math.nan, math.inf)))
identity = st.one_of(st.integers(1, 4), st.sampled_from((0, -(2**63), 2**63 - 1)))


@st.composite
def odometries(draw: st.DrawFn) -> Odometry:
    message = conversions.ego_to_message(
        conversions.EgoPose(draw(number), draw(number), draw(st.floats(-4.0, 4.0)), draw(number)), 0
    )
    if draw(st.integers(0, 3)) == 0:
        q = message.pose.pose.orientation
        q.x, q.y, q.z, q.w = (draw(number) for _ in range(4))
    return message


@st.composite
def areas(draw: st.DrawFn) -> PolygonStamped:
    if draw(st.booleans()):
        return conversions.area_to_message(square(40.0), 0)
    corners = draw(st.lists(st.tuples(number_32, number_32), max_size=8))
    message = conversions.area_to_message(np.empty((0, 2)), 0)
    message.polygon.points = [
        Point32(x=float(np.float32(x)), y=float(np.float32(y))) for x, y in corners
    ]
    return message


@st.composite
def objects(draw: st.DrawFn) -> PerceivedObjects:
    rows = draw(
        st.lists(st.tuples(identity, number, number, number, number, number, number), max_size=4)
    )
    message = PerceivedObjects(header=conversions.header(0, "map"))
    message.objects = [
        PerceivedObject(
            id=i, x_m=x, y_m=y, heading_rad=heading, speed_mps=speed, length_m=length, width_m=width
        )
        for i, x, y, heading, speed, length, width in rows
    ]
    return message


def crossing(route: tuple[int, ...]) -> IntersectionModel:
    if route != (10,):
        raise DisconnectedRouteError("lanelet 3 does not follow lanelet 2")
    return crossing_model()


def evaluation(memory: str, complaints: list[str]) -> Evaluation:
    pipeline = SituationPipeline(crossing, SituationConfig(memory=memory))
    made = Evaluation(
        MapParameters(), EgoParameters(), ObjectsAdapter(), pipeline, Plausibility(),
        complaints.append,
    )  # fmt: skip
    made.begin((10,), 0)
    return made


def test_a_route_whose_model_fails_for_a_reason_of_our_own_is_a_fault() -> None:
    def fail(_: tuple[int, ...]) -> IntersectionModel:
        raise ZeroDivisionError("of our own")

    complaints: list[str] = []
    made = Evaluation(
        MapParameters(), EgoParameters(), ObjectsAdapter(), SituationPipeline(fail),
        Plausibility(), complaints.append,
    )  # fmt: skip
    assert made.begin((10,), 0)
    report = made.pipeline.route_report(1000 * MS)
    assert (report.status, report.source) == (Status.INTERNAL_ERROR, FaultyInput.ROUTE)
    assert "of our own" in report.text
    assert "Traceback" in complaints[0]


@pytest.mark.parametrize(("older_ms", "expected_m"), [(0, 20.0), (200, 19.2), (-50, 20.2)])
def test_an_ego_of_another_time_than_the_objects_is_taken_to_drive_on(
    older_ms: int, expected_m: float
) -> None:
    made = evaluation("instantaneous", [])
    ego = conversions.EgoPose(-20.0, 0.0, 0.0, 4.0)
    odometry = conversions.ego_to_message(ego, (1000 - older_ms) * MS)
    area = conversions.area_to_message(square(40.0), 1000 * MS)
    objects = conversions.objects_to_message(object_arrays(), 1000 * MS)
    received = conversions.read_area.of(area), conversions.read_objects.of(objects)
    report, _ = made.report(Frame(1000 * MS, (odometry,), *received))
    assert report.situations is not None
    assert report.situations.lane_ego_distance_m[0, 0] == pytest.approx(expected_m)


def test_an_ego_is_between_the_odometry_before_and_after_the_objects() -> None:
    made = evaluation("instantaneous", [])
    poses = (900, -20.0, 4.0), (1050, -19.4, 4.6)
    odometry = tuple(
        conversions.ego_to_message(conversions.EgoPose(x, 0.0, 0.0, mps), stamp_ms * MS)
        for stamp_ms, x, mps in poses
    )
    area = conversions.area_to_message(square(40.0), 1000 * MS)
    objects = conversions.objects_to_message(object_arrays(), 1000 * MS)
    received = conversions.read_area.of(area), conversions.read_objects.of(objects)
    report, _ = made.report(Frame(1000 * MS, odometry, *received))
    assert report.situations is not None
    assert report.situations.lane_ego_distance_m[0, 0] == pytest.approx(19.6)
    assert report.situations.ego_speed_mps[0] == pytest.approx(4.4)
    far = conversions.ego_to_message(conversions.EgoPose(-2.0, 0.0, 0.0, 4.6), 1150 * MS)
    report, _ = made.report(Frame(1100 * MS, (odometry[1], far), *received))
    assert (report.status, report.source) == (Status.IMPLAUSIBLE_JUMP, FaultyInput.ODOMETRY)


def stamped(message: Message, stamp_ns: int) -> Message:
    message.header.stamp = conversions.to_stamp(stamp_ns)
    return message


perceived = st.lists(st.tuples(odometries(), areas(), objects()), min_size=1, max_size=3)


@pytest.mark.parametrize("memory", ["instantaneous", "tracked"])
@drawn(500)
@given(seen=perceived)
def test_whatever_is_perceived_gives_a_sound_situation_or_a_fault_that_is_the_inputs(
    memory: str, seen: list[tuple[Odometry, PolygonStamped, PerceivedObjects]]
) -> None:
    complaints: list[str] = []
    node = evaluation(memory, complaints)
    for k, messages in enumerate(seen):
        stamp_ns = 1000 * MS + 100 * MS * k
        odometry, area, objects = (stamped(message, stamp_ns) for message in messages)
        received = conversions.read_area.of(area), conversions.read_objects.of(objects)
        frame = Frame(stamp_ns, (odometry,), *received)
        report, _ = node.report(frame)
        assert not complaints
        if report.status is Status.OK:
            message = conversions.situation_to_message(report)
            back = conversions.situation_from_records(over_the_wire(message))
            assert back.situations is not None
        else:
            assert report.status is not Status.INTERNAL_ERROR
            assert report.source is not FaultyInput.NO_INPUT
            assert report.text


@st.composite
def situations(draw: st.DrawFn, values: st.SearchStrategy[float]) -> Situation:
    lanes = draw(st.lists(identity, max_size=3))
    above_0 = values.map(abs)
    size = st.one_of(above_0, above_0, above_0, above_0, above_0, values)
    return Situation(
        header=conversions.header(draw(st.integers(0, 3)) * 500 * MS, "map"),
        status=draw(st.one_of(st.just(0), st.just(0), st.integers(0, 255))),
        faulty_input=draw(st.one_of(st.just(0), st.integers(0, 255))),
        route=[10],
        stop_line_distance_m=draw(values),
        goal_distance_m=draw(values),
        ego_speed_mps=draw(values),
        lanes=[
            IntersectingLane(
                lane_id=lane,
                kind=draw(st.integers(0, 255)),
                ego_distance_m=draw(values),
                ego_zone_m=draw(size),
                zone_m=draw(size),
                hidden_distance_m=draw(values),
                speed_limit_mps=draw(size),
            )
            for lane in lanes
        ],
        vehicles=[
            RelevantVehicle(
                vehicle_id=draw(identity),
                lane_id=draw(st.sampled_from([*lanes, 99])),
                distance_m=draw(values),
                speed_mps=draw(values),
            )
            for _ in range(draw(st.integers(0, 3)))
        ],
    )


def over_the_wire(message: Situation) -> SituationRecords:
    return read_situation(bytes(serialize_message(message)))


def read_or_refused(message: SituationRecords) -> SituationReport | InputError:
    try:
        return conversions.situation_from_records(message)
    except InputError as error:
        return error


@drawn(1000)
@given(message=situations(number))
def test_whatever_a_situation_says_it_is_read_or_refused_by_name(message: Situation) -> None:
    read = read_or_refused(over_the_wire(message))
    if isinstance(read, InputError):
        assert read.kind in (Status.MALFORMED_INPUT, Status.NOT_FINITE)
        assert read.source is FaultyInput.SITUATION
    else:
        assert (read.situations is not None) == (read.status is Status.OK)


@pytest.mark.parametrize("policy", ["rule_based", "fastest_sound", "look_ahead"])
@drawn(200)
@given(messages=st.lists(situations(finite), min_size=1, max_size=3))
def test_whatever_is_finite_in_a_situation_leads_to_a_decision(
    policy: str, messages: list[Situation]
) -> None:
    loaded = POLICIES.setdefault(policy, load_supervised(policy, SupervisorMode.ENFORCE))
    decider = Decider(loaded, explain, DeciderConfig(recovery_s=0.0))
    for k, message in enumerate(messages):
        now_ns = 500 * MS * k
        read = read_or_refused(over_the_wire(message))
        if isinstance(read, SituationReport):
            decider.receive(read, now_ns)
        choice = decider.decide(now_ns)
        said = conversions.decision_to_message(choice.decision, now_ns, choice.situation_stamp_ns)
        assert conversions.decision_from_message(said).action in set(Action)
        assert math.isfinite(said.target_speed_mps)


@drawn(1000)
@given(message=situations(number), data=st.data())
def test_a_situation_with_spoilt_bytes_is_read_or_refused(
    message: Situation, data: st.DataObject
) -> None:
    whole = bytearray(serialize_message(message))
    places = st.integers(0, len(whole) - 1)
    for place in data.draw(st.lists(places, min_size=1, max_size=8)):
        whole[place] = data.draw(st.integers(0, 255))
    try:
        records = read_situation(bytes(whole))
    except ValueError:
        return
    read = read_or_refused(records)
    if isinstance(read, SituationReport):
        assert (read.situations is not None) == (read.status is Status.OK)
