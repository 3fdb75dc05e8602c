# SPDX-License-Identifier: Apache-2.0
"""What the planner's real nodes decide on hand-made inputs."""

import math
import time
from dataclasses import replace

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from intersection_msgs.msg import Decision, Situation
from planner_driver import PlannerDriver, Scene, Vehicle

from risk_dqn_planner.intersection.model import ConflictPath

pytestmark = pytest.mark.ros

FREE = Scene(ego_mps=0.4)  # it stays where it is, so it must not say to drive


@pytest.fixture(autouse=True)
def fresh(planner: PlannerDriver) -> None:
    planner.send_route(planner.model.route)
    planner.pause()


def first_path(planner: PlannerDriver) -> ConflictPath:
    return planner.model.lanes[0].paths[0]


def test_on_a_free_road_that_is_seen_to_its_ends_the_ego_drives_fast(
    planner: PlannerDriver,
) -> None:
    decision = planner.decide(FREE)
    assert decision.action == Decision.FAST
    assert decision.reason == Decision.CLEAR
    assert decision.target_speed_mps == 5.0
    assert planner.situation().status == Situation.OK
    assert planner.situation().stop_line_distance_m == pytest.approx(10.0, abs=1e-3)


def test_a_near_vehicle_stops_the_ego_and_is_named(planner: PlannerDriver) -> None:
    vehicle = Vehicle(
        id=7_000_000_000_000, path=first_path(planner), distance_m=15.0, speed_mps=6.0
    )
    decision = planner.decide(replace(FREE, ego_mps=5.0, stop_line_m=3.0, vehicles=(vehicle,)))
    assert decision.action == Decision.STOP
    assert decision.reason == Decision.VEHICLE
    assert decision.critical_vehicle_id == vehicle.id
    assert decision.critical_lane_id == planner.model.lanes[0].lane_id
    assert str(vehicle.id) in decision.text


def test_a_lane_that_may_hide_a_vehicle_stops_the_ego(planner: PlannerDriver) -> None:
    decision = planner.decide(replace(FREE, ego_mps=5.0, stop_line_m=3.0, seen_m=15.0))
    assert decision.action == Decision.STOP
    assert decision.reason == Decision.HIDDEN_VEHICLE
    assert decision.critical_vehicle_id == Decision.NO_ID
    assert decision.critical_lane_id in {lane.lane_id for lane in planner.model.lanes}


def test_decisions_are_taken_on_the_situation_of_their_time(planner: PlannerDriver) -> None:
    decision = planner.decide(FREE)
    assert decision.header.stamp == decision.situation_stamp
    assert decision.situation_age_s == 0.0
    assert decision.policy_name == "rule_based"
    assert len(decision.policy_hash) == 64


def test_inputs_that_stop_stop_the_ego_within_a_second(planner: PlannerDriver) -> None:
    assert planner.decide(FREE).action == Decision.FAST
    planner.wait()
    decision = planner.wait()
    assert decision.action == Decision.STOP
    assert decision.reason == Decision.STALE_INPUT
    assert decision.faulty_input == Decision.ODOMETRY
    assert "old" in decision.text


def test_the_ego_drives_again_once_inputs_have_been_back_for_a_second(
    planner: PlannerDriver,
) -> None:
    assert planner.decide(FREE).action == Decision.FAST
    for _ in range(3):
        assert planner.wait().action == Decision.STOP
    for _ in range(2):
        assert planner.decide(FREE).reason == Decision.RECOVERING
    assert planner.decide(FREE).action == Decision.FAST


def test_a_number_that_is_none_stops_the_ego_and_is_named(planner: PlannerDriver) -> None:
    broken = FREE.odometry(planner.model, planner.now_ns + 500_000_000)
    broken.twist.twist.linear.x = math.nan
    decision = planner.decide(FREE, odometry=broken)
    assert decision.action == Decision.STOP
    assert (decision.reason, decision.faulty_input) == (Decision.NOT_FINITE, Decision.ODOMETRY)
    assert "speed_mps is nan" in decision.text
    assert planner.situation().status == Situation.NOT_FINITE
    for _ in range(2):
        assert planner.decide(FREE).reason == Decision.RECOVERING
    assert planner.decide(FREE).action == Decision.FAST


def test_inputs_in_another_frame_stop_the_ego(planner: PlannerDriver) -> None:
    decision = planner.decide(replace(FREE, frame="odom"))
    assert (decision.action, decision.reason) == (Decision.STOP, Decision.WRONG_FRAME)
    assert "'odom'" in decision.text


def test_an_ego_beside_its_route_stops(planner: PlannerDriver) -> None:
    decision = planner.decide(replace(FREE, aside_m=8.0))
    assert (decision.action, decision.reason) == (Decision.STOP, Decision.OFF_ROUTE)
    assert planner.situation().status == Situation.OFF_ROUTE


@pytest.mark.parametrize(
    ("route", "complaint"),
    [([1, 424242, 4], "424242"), ([1, 4], "does not follow"), ([], "empty")],
    ids=["unknown lanelet", "disconnected", "empty"],
)
def test_a_route_that_does_not_fit_the_map_stops_the_ego_until_a_better_one_comes(
    planner: PlannerDriver, route: list[int], complaint: str
) -> None:
    planner.send_route(route)
    decision = decide_until(planner, Decision.BAD_ROUTE)
    assert decision.action == Decision.STOP
    assert planner.situation().status == Situation.BAD_ROUTE
    assert complaint in decision.text
    planner.send_route(planner.model.route)
    assert decide_until(planner, Decision.CLEAR).action == Decision.FAST


def decide_until(planner: PlannerDriver, reason: int) -> Decision:
    """Decide on a free road until the reason is given: routes may come after the inputs."""
    for _ in range(10):
        decision = planner.decide(FREE)
        if decision.reason == reason:
            return decision
    raise AssertionError(f"never decided for reason {reason}, but {decision.reason} at last")


def test_a_fault_is_a_diagnostic_error_and_its_end_is_too(planner: PlannerDriver) -> None:
    name = "policy: decision"
    planner.decide(FREE)
    planner.wait_for(lambda: planner.diagnostics[name].level == DiagnosticStatus.OK)
    planner.wait()
    planner.wait()
    planner.wait_for(lambda: planner.diagnostics[name].level == DiagnosticStatus.ERROR)
    for _ in range(3):
        planner.decide(FREE)
    planner.wait_for(lambda: planner.diagnostics[name].level == DiagnosticStatus.OK)


def test_the_diagnostics_of_an_input_tell_of_its_fault_at_once(planner: PlannerDriver) -> None:
    twin = Vehicle(id=5, path=first_path(planner), distance_m=30.0, speed_mps=1.0)
    planner.decide(FREE)
    waited_s = 0.0
    for name, scene in (
        ("situation: objects", replace(FREE, vehicles=(twin, twin))),
        ("situation: visible area", replace(FREE, seen_m=0.0)),
        ("situation: odometry", replace(FREE, aside_m=30.0)),
    ):
        planner.decide(scene)
        began_s = time.monotonic()
        planner.wait_for(
            lambda name=name: planner.diagnostics[name].level == DiagnosticStatus.ERROR
        )
        waited_s += time.monotonic() - began_s
    # Entries that came once a second would take longer, three times, but for one case in fifty.
    assert waited_s < 0.5


def test_the_diagnostics_of_an_input_tell_at_once_that_its_fault_is_over(
    planner: PlannerDriver,
) -> None:
    name = "situation: odometry"
    waited_s = 0.0
    for _ in range(3):
        planner.decide(replace(FREE, aside_m=30.0))
        planner.wait_for(lambda: planner.diagnostics[name].level == DiagnosticStatus.ERROR)
        for _ in range(5):  # it jumps back, and both are told of for a second
            planner.decide(FREE)
        began_s = time.monotonic()
        # A warning is left: these scenes come twice a second only.
        planner.wait_for(lambda: planner.diagnostics[name].level == DiagnosticStatus.WARN)
        waited_s += time.monotonic() - began_s
    assert waited_s < 0.5
