# SPDX-License-Identifier: Apache-2.0
"""Nodes that are killed and started again in mid-drive, and faults in real time."""

import itertools
import time
from collections.abc import Callable, Iterator

import pytest
from fault_cases import INPUT_TOPICS, OBJECTS, ODOMETRY, Told
from fault_driver import REAL, Ears, drive_at, fault_nodes
from fault_nodes import NodePair
from fault_verdict import told_by
from intersection_msgs.msg import Decision
from rclpy.node import Node

from risk_dqn_planner.decision import Reason
from risk_dqn_planner.faults import FaultyInput
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.ros import conversions
from sim_bridge.ros.session import wait_until

pytestmark = pytest.mark.ros

START_S = 180.0
FRAME_S = 0.1
# What is seen is told of by the next decision, 0.5 s later; an input may be 0.5 s old before. The
# rest is for a busy computer.
BUSY_S = 0.4
LONGEST_GAP_S = 1.5  # decisions are due every 0.5 s; other files of tests take processors too


class Drive:
    """Publishes the healthy drive in real time; an input may be broken meanwhile."""

    def __init__(self, node: Node, nodes: NodePair, model: IntersectionModel) -> None:
        self.node, self.nodes, self.model = node, nodes, model
        self.ears = Ears(node)
        self.publishers = {
            source: node.create_publisher(topic.message, topic.name, topic.qos)
            for source, topic in INPUT_TOPICS.items()
            if source is not FaultyInput.SITUATION
        }
        self.breaks: dict[FaultyInput, Callable[[object], object | None]] = {}
        self._errand_ns = 0
        self._timer = node.create_timer(FRAME_S, self._publish)

    def _now_ns(self) -> int:
        return int(self.node.get_clock().now().nanoseconds)

    def begin(self) -> None:
        """Begin an errand and wait until the policy decides on it."""
        self._errand_ns = self._now_ns()
        route = conversions.route_to_message(self.model.route, self._errand_ns)
        self.publishers[FaultyInput.ROUTE].publish(route)
        self.await_decision(lambda d: d.reason == Decision.FIXED, "the policy to decide")

    def _publish(self) -> None:
        now_ns = self._now_ns()
        scene = drive_at(self.model, 1e-9 * (now_ns - self._errand_ns))
        for source, message in (
            (FaultyInput.ODOMETRY, scene.odometry(self.model, now_ns)),
            (FaultyInput.VISIBLE_AREA, scene.visible_area(self.model, now_ns)),
            (FaultyInput.OBJECTS, scene.objects(now_ns)),
        ):
            sent = self.breaks[source](message) if source in self.breaks else message
            if sent is not None:
                self.publishers[source].publish(sent)

    def await_decision(self, holds: Callable[[Decision], bool], what: str) -> float:
        """Wait until a new decision is such; return how long that took [s]."""
        began, first = time.monotonic(), len(self.ears.decisions)
        new = itertools.count(first)
        number = next(new)

        def found() -> bool:
            nonlocal number
            while number < len(self.ears.decisions):
                if holds(self.ears.decisions[number]):
                    return True
                number = next(new)
            return False

        wait_until(found, what, START_S, self.nodes.check)
        return self.ears.arrivals_s[number] - began

    def longest_gap_s(self, since: int) -> float:
        """Return the longest time between decisions from one of them on."""
        return max(b - a for a, b in itertools.pairwise(self.ears.arrivals_s[since:]))


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Drive]:
    with fault_nodes(tmp_path_factory.mktemp("killed"), REAL) as running:
        yield Drive(*running)


def lose(_: object) -> None:
    return None


def to_another_frame(message: object) -> object:
    message.header.frame_id = "odom"  # type: ignore[attr-defined]
    return message


@pytest.mark.parametrize(
    ("source", "breaks", "told", "within_s"),
    [
        (ODOMETRY, lose, Told(Reason.STALE_INPUT, ODOMETRY), 1.0),
        (OBJECTS, to_another_frame, Told(Reason.WRONG_FRAME, OBJECTS), 0.6),
    ],
    ids=["odometry lost", "objects in another frame"],
)
def test_in_real_time_a_fault_is_answered_just_as_fast(
    drive: Drive,
    source: FaultyInput,
    breaks: Callable[[object], object | None],
    told: Told,
    within_s: float,
) -> None:
    drive.begin()
    since = len(drive.ears.decisions) - 1
    drive.breaks[source] = breaks
    assert drive.await_decision(lambda d: told_by(d) == told, str(told)) <= within_s + BUSY_S
    del drive.breaks[source]
    healed_s = drive.await_decision(lambda d: d.reason == Decision.FIXED, "recovery")
    assert healed_s <= 1.6 + BUSY_S
    assert drive.longest_gap_s(since) < LONGEST_GAP_S


def test_a_killed_situation_node_stops_the_ego_until_it_is_back(drive: Drive) -> None:
    drive.begin()
    since = len(drive.ears.decisions) - 1
    drive.nodes.kill("situation_node")
    silent = {Reason.STALE_INPUT, Reason.FROZEN_INPUT}
    took_s = drive.await_decision(lambda d: d.action == Decision.STOP, "STOP")
    assert took_s <= 1.0 + BUSY_S
    assert told_by(drive.ears.decisions[-1]).reason in silent
    assert drive.ears.decisions[-1].faulty_input == Decision.SITUATION
    stopped = len(drive.ears.decisions)
    drive.nodes.start("situation_node")
    drive.await_decision(lambda d: d.reason == Decision.FIXED, "the situation node to be back")
    meanwhile = drive.ears.decisions[stopped - 1 : -1]
    assert {d.action for d in meanwhile if d.reason != Decision.FIXED} == {Decision.STOP}
    assert drive.longest_gap_s(since) < LONGEST_GAP_S


def test_a_killed_policy_node_says_stop_once_it_is_back_until_it_knows_enough(
    drive: Drive,
) -> None:
    drive.begin()
    # With the situation node it may know enough before it is heard; without, it cannot.
    drive.nodes.kill("situation_node")
    drive.nodes.kill("policy_node")
    time.sleep(0.2)  # what it said last may be on its way
    since = len(drive.ears.decisions)
    drive.nodes.start("policy_node")
    nothing_known = Told(Reason.MISSING_INPUT, FaultyInput.SITUATION)
    drive.await_decision(lambda d: told_by(d) == nothing_known, str(nothing_known))
    drive.nodes.start("situation_node")
    drive.await_decision(lambda d: d.reason == Decision.FIXED, "both nodes to be back")
    said = drive.ears.decisions[since:]
    first = next(k for k, d in enumerate(said) if d.reason == Decision.FIXED)
    assert {d.action for d in said[:first]} == {Decision.STOP}
    assert said[0].reason in (Decision.POLICY_NOT_READY, Decision.MISSING_INPUT)
    assert drive.longest_gap_s(since) < LONGEST_GAP_S


def test_nodes_that_went_through_that_end_when_asked(drive: Drive) -> None:
    for name, (code, output) in drive.nodes.end().items():
        assert code == 0, name
        assert "Traceback" not in output, output
