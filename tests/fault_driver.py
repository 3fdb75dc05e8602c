# SPDX-License-Identifier: Apache-2.0
"""Plays a healthy drive to running planner nodes and disturbs it, in simulated time.

A frame of inputs comes every 0.1 s and a decision is due every 0.5 s. Time goes on once the nodes
have answered, so what is measured are properties of the planner and not of a busy computer.
"""

import copy
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from fault_cases import INPUT_TOPICS, Case
from fault_disturbances import Frame, Message
from fault_nodes import NodePair
from intersection_msgs.msg import Decision, Situation
from planner_driver import Scene, Vehicle
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import load_map
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.ros.conversions import to_ns, to_stamp
from risk_dqn_planner.ros.qos import DIAGNOSTICS
from risk_dqn_planner.ros.streams import SECOND_NS
from risk_dqn_planner.situation.report import FaultyInput
from sim_bridge.ros import topics
from sim_bridge.ros.process import ParameterValue
from sim_bridge.ros.run_settings import own_map_settings
from sim_bridge.ros.session import ros_session, wait_until

STEP_NS = SECOND_NS // 10
PERIOD_NS = SECOND_NS // 2
ANSWER_S = 10.0
START_S = 240.0
# Of frames without objects the nodes say nothing, but need time to notice that they came.
_NOTICE_S = 0.03
_CLOCK_AGAIN_S = 0.1
_DRIVES_S, _DRIVES_MPS = 12.0, 3.0
_PAST = 40
SIMULATED: dict[str, ParameterValue] = {"sim_time_patience_s": 0.1}
# The limits of a vehicle, which the settings of simulated drives relax.
REAL: dict[str, ParameterValue] = {
    "use_sim_time": False,
    "max_input_ahead_s": 0.2,
    "max_situation_ahead_s": 0.2,
}


@contextmanager
def fault_nodes(
    logs: Path, more: Mapping[str, ParameterValue]
) -> Iterator[tuple[Node, NodePair, IntersectionModel]]:
    """Start situation and policy node on the four-way crossing; the policy always drives fast."""
    settings = replace(own_map_settings(policy="always_fast", supervisor="off"), overrides=more)
    road_map = load_map(settings.map_file, settings.origin, settings.projector)
    model = build_intersection(road_map, settings.route)
    commands = settings.planner_commands()
    with ros_session("faults") as node, NodePair(commands, logs) as nodes:
        yield node, nodes, model


def drive_at(model: IntersectionModel, since_s: float) -> Scene:
    """The ego drives towards its stop line, two others towards the crossing; then all stand."""
    driven_m = _DRIVES_MPS * min(since_s, _DRIVES_S)
    speed_mps = _DRIVES_MPS if since_s < _DRIVES_S else 0.0
    others = [
        Vehicle(id=10 + k, path=lane.paths[0], distance_m=42.0 - driven_m, speed_mps=speed_mps)
        for k, lane in enumerate(model.lanes[:2])
    ]
    return Scene(stop_line_m=45.0 - driven_m, ego_mps=speed_mps, vehicles=others)


class Ears:
    """Everything the nodes say."""

    def __init__(self, node: Node) -> None:
        self.changed = threading.Condition()
        self.decisions: list[Decision] = []
        self.arrivals_s: list[float] = []  # of the decisions, on the steady clock
        self.situations: deque[Situation] = deque(maxlen=10)
        self.heard_situations = 0
        self.diagnostics: dict[str, DiagnosticStatus] = {}
        for topic, react in (
            (topics.DECISION, self._on_decision),
            (topics.SITUATION, self._on_situation),
        ):
            node.create_subscription(topic.message, topic.name, react, topic.qos)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_status, DIAGNOSTICS)

    def _on_decision(self, message: Decision) -> None:
        with self.changed:
            self.decisions.append(message)
            self.arrivals_s.append(time.monotonic())
            self.changed.notify_all()

    def _on_situation(self, message: Situation) -> None:
        with self.changed:
            self.situations.append(message)
            self.heard_situations += 1
            self.changed.notify_all()

    def _on_status(self, message: DiagnosticArray) -> None:
        with self.changed:
            self.diagnostics.update({status.name: status for status in message.status})
            self.changed.notify_all()

    def newest_ns(self) -> int:
        """Return the time of the newest decision."""
        return to_ns(self.decisions[-1].header.stamp) if self.decisions else -1

    def wait(self, holds: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until something heard makes a condition hold; tell whether it did in time."""
        with self.changed:
            return self.changed.wait_for(holds, timeout=timeout_s)


@dataclass(frozen=True)
class Reaction:
    """What came of a fault. Times in simulated seconds; decisions in their order.

    react_s: from the first disturbed frame to the first Stop for it, None if there was none.
    recover_s: from the first healthy frame after it to the first decision of the policy.
    during: all decisions from the first disturbed frame to the first healthy one. after: from
    there to the policy's own again.
    levels: of the diagnostics while it lasted, None where nobody looked at them.
    """

    react_s: float | None
    recover_s: float | None
    during: Sequence[Decision]
    after: Sequence[Decision]
    levels: Mapping[str, bytes] | None = None


class FaultDriver:
    """Time, inputs and ears for two running nodes whose policy always drives fast."""

    def __init__(self, node: Node, nodes: NodePair, model: IntersectionModel) -> None:
        self.node, self.nodes, self.model = node, nodes, model
        self.ears = Ears(node)
        self.now_ns = 20 * SECOND_NS  # later than any jump back
        self.offset_ns = 0  # of the clock, against the stamps
        self._clock = node.create_publisher(Clock, "/clock", QoSProfile(depth=10))
        self.publishers = {
            source: node.create_publisher(topic.message, topic.name, topic.qos)
            for source, topic in INPUT_TOPICS.items()
        }
        self._past: dict[FaultyInput, deque[Message]] = {}
        self._before: Message = None
        self._errand_ns = 0

    def meet(self) -> None:
        """Wait until the nodes are up and drive."""

        def ready() -> bool:
            inputs = all(p.get_subscription_count() > 0 for p in self.publishers.values())
            said = self.ears.decisions
            loaded = bool(said) and said[-1].reason != Decision.POLICY_NOT_READY
            return inputs and loaded and self._clock.get_subscription_count() >= 2

        wait_until(ready, "the nodes to come up", START_S, self.nodes.check)
        self.tick()
        self.begin()

    def begin(self) -> None:
        """Begin an errand at the start of the drive, and go on until the policy decides."""
        self._past = {source: deque(maxlen=_PAST) for source in INPUT_TOPICS}
        self.now_ns += STEP_NS
        self._errand_ns = self.now_ns
        self.now_ns -= STEP_NS
        self.send_route(self.model.route)
        self.recover(8.0)

    def send_route(self, route: Sequence[int]) -> None:
        """Publish a route as a new errand."""
        message = conversions.route_to_message(route, self._errand_ns)
        self.publishers[FaultyInput.ROUTE].publish(message)

    def tick(self) -> None:
        """Publish the time."""
        self._clock.publish(Clock(clock=to_stamp(self.now_ns + self.offset_ns)))

    def healthy(self) -> dict[FaultyInput, Message]:
        """Return the messages of the present time, without a fault."""
        scene = drive_at(self.model, (self.now_ns - self._errand_ns) / SECOND_NS)
        return {
            FaultyInput.ODOMETRY: scene.odometry(self.model, self.now_ns),
            FaultyInput.VISIBLE_AREA: scene.visible_area(self.model, self.now_ns),
            FaultyInput.OBJECTS: scene.objects(self.now_ns),
        }

    def latest(self) -> dict[FaultyInput, Message]:
        """Return what is not sent with every frame: the route, and the newest situation."""
        return {source: self._base(source) for source in (FaultyInput.ROUTE, FaultyInput.SITUATION)}

    def step(self, case: Case | None = None, number: int = 0) -> None:
        """Go on by one frame, disturbed by a case if one is given; `number` of frames before."""
        self.now_ns += STEP_NS
        self.publish(case, number)
        self.tick()
        if (self.now_ns + self.offset_ns) % PERIOD_NS == 0:
            self._await_decision()

    def publish(self, case: Case | None = None, number: int = 0) -> None:
        """Publish the frame of the present time, and wait until its situation has come."""
        heard, comes = self.ears.heard_situations, False
        for source, message in self.healthy().items():
            self._past[source].append(message)
            sent = [message]
            if case is not None and case.source is source:
                sent = self._disturbed(case, number, message)
            for one in sent:
                self.publishers[source].publish(one)
            comes = bool(sent) and source is FaultyInput.OBJECTS
        patience_s = ANSWER_S if comes else _NOTICE_S
        self.ears.wait(lambda: self.ears.heard_situations > heard, patience_s)
        if case is not None and case.source in (FaultyInput.ROUTE, FaultyInput.SITUATION):
            base = self._base(case.source)
            for one in self._disturbed(case, number, base):
                self.publishers[case.source].publish(one)
            time.sleep(_NOTICE_S)

    def _base(self, source: FaultyInput) -> Message:
        if source is FaultyInput.ROUTE:
            return conversions.route_to_message(self.model.route, self.now_ns)
        return self.ears.situations[-1]

    def _disturbed(self, case: Case, number: int, message: Message) -> list[Message]:
        past = list(self._past.get(case.source, ()))
        if number == 0:
            self._before = past[-2] if len(past) > 1 else message
        given = (copy.deepcopy(message), past, self._before)
        frame = Frame(number, *given, self.now_ns, self.model)
        return list(case.disturb(frame))

    def jump(self, clock_s: float, stamps_s: float) -> None:
        """Let the clock and the stamps of all inputs jump; both on multiples of the period."""
        moved_ns = round(stamps_s * SECOND_NS)
        self.now_ns += moved_ns
        self._errand_ns += moved_ns
        self.offset_ns += round(clock_s * SECOND_NS) - moved_ns
        for _ in range(3):
            self.tick()
            time.sleep(0.02)

    def set_clock_timeout(self, timeout_s: float) -> None:
        """Let the policy node take a clock for standing after so long in real time."""
        value = Parameter("clock_timeout_s", value=timeout_s).to_parameter_msg()
        client = self.node.create_client(SetParameters, "/policy/set_parameters")
        wait_until(client.service_is_ready, "parameters", ANSWER_S, self.nodes.check)
        answer = client.call_async(SetParameters.Request(parameters=[value]))
        wait_until(answer.done, "an answer", ANSWER_S, self.nodes.check)
        self.node.destroy_client(client)

    def _await_decision(self) -> None:
        """Wait for the decision of the present time; /clock is best effort, so send it again."""
        due_ns = self.now_ns + self.offset_ns
        deadline = time.monotonic() + ANSWER_S
        while time.monotonic() < deadline:
            if self.ears.wait(lambda: self.ears.newest_ns() == due_ns, _CLOCK_AGAIN_S):
                return
            self.nodes.check()
            self.tick()
        raise AssertionError(f"no decision at {due_ns / SECOND_NS:.1f} s")

    def drives(self) -> bool:
        """Whether there is a decision of this time, and it is the policy's own."""
        fresh = self.ears.newest_ns() == self.now_ns + self.offset_ns
        return fresh and self.ears.decisions[-1].reason == Decision.FIXED

    def recover(self, within_s: float) -> None:
        """Go on without a fault until the policy decides."""
        for _ in range(round(within_s * SECOND_NS / STEP_NS)):
            self.step()
            if self.drives():
                return
        self.nodes.check()
        raise AssertionError(f"still '{self.ears.decisions[-1].text}' after {within_s:g} s")

    def suffer(self, case: Case, phase: int = 0) -> Reaction:
        """Drive, suffer a fault from `phase` frames after a decision on, and recover."""
        self.begin()
        for _ in range(phase):
            self.step()
        began, begun_ns = len(self.ears.decisions), self.now_ns + STEP_NS
        number = 0
        for number in range(case.frames):
            self.step(case, number)
        watched = case.frames > 1 and phase == 0
        levels = self._watch_levels(case, number) if watched else None
        ended, healed_ns = len(self.ears.decisions), self.now_ns + STEP_NS
        if case.source is FaultyInput.ROUTE:
            self._errand_ns = healed_ns
            self.send_route(self.model.route)
        self._drive_on(case, began)
        decisions = self.ears.decisions
        during, after = decisions[began:ended], decisions[ended:]
        stopped = [d for d in decisions[began:] if d.action == Decision.STOP]
        own = [d for d in after if d.reason == Decision.FIXED]
        return Reaction(
            (to_ns(stopped[0].header.stamp) - begun_ns) / SECOND_NS if stopped else None,
            (to_ns(own[-1].header.stamp) - healed_ns) / SECOND_NS if own else None,
            during, after, levels,
        )  # fmt: skip

    def _drive_on(self, case: Case, began: int) -> None:
        """Go on without the fault until it has been told of and overcome."""
        for _ in range(60):
            self.step()
            told = case.told is None or any(
                d.action == Decision.STOP for d in self.ears.decisions[began:]
            )
            if told and self.drives():
                return

    def _watch_levels(self, case: Case, number: int) -> dict[str, bytes]:
        """Go on with the fault until the diagnostics are as expected, or time is up."""
        deadline = time.monotonic() + 5.0

        def levels() -> dict[str, bytes]:
            with self.ears.changed:
                return {
                    name: self.ears.diagnostics[name].level
                    for name in case.levels
                    if name in self.ears.diagnostics
                }

        while levels() != dict(case.levels) and time.monotonic() < deadline:
            number += 1
            time.sleep(0.02)
            self.step(case, number)
        return levels()
