# SPDX-License-Identifier: Apache-2.0
"""Situations to the policy node, and how long each decision takes.

Decisions are taken by a timer, so in real time a situation waits up to half a second for the next
one. In simulated time the node can be asked to decide and still lack the situation: the clock goes
on to t first, then the situation of t is published, and the node decides as soon as it has it.
From before publishing until the decision arrives: transport both ways, conversion, policy,
supervisor and explanation.
"""

import struct
import time
from pathlib import Path

from intersection_msgs.msg import Decision, Situation
from rclpy.node import Node
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from bench.nodes.listening import Ear, Spread, spread, undisturbed
from bench.nodes.scene import MovingScene, perception
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.policies.base import Reason
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.ros.streams import SECOND_NS
from risk_dqn_planner.situation.pipeline import SituationPipeline
from sim_bridge.ros import topics
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.planner_link import DECISION_PERIOD_NS
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.ros.session import SilentPlannerError, ros_session, wait_until

START_S = 240.0
_WARM_UP = 10
_NOTICE_S = 0.03  # the node has seen the clock by then
_ANSWER_S = 0.5
_WORK = 30_000  # some milliseconds
_LOST = 0.5  # share of decisions that may be lost: a busy computer loses messages of the clock


def situations(model: IntersectionModel, objects: int, count: int) -> list[bytes]:
    """Return serialised situations, one for each decision, from the objects of a moving scene.

    Raises:
        SystemExit: the scene is refused, which is a mistake of the benchmark's own.
    """
    period_s = DECISION_PERIOD_NS / SECOND_NS
    scene = MovingScene(model, objects, count * period_s, seed=1)
    pipeline = SituationPipeline(lambda _route: model)
    pipeline.select(model.route)
    made = []
    for k in range(count):
        stamp_ns = (k + 1) * DECISION_PERIOD_NS
        seen = perception(scene.inputs(k * period_s, stamp_ns))
        message = conversions.situation_to_message(pipeline.report(stamp_ns, seen))
        if message.status != Situation.OK:
            raise SystemExit(f"the benchmark's own input is refused: {message.status_text}")
        made.append(serialize_message(message))
    return made


def restamped(situation: bytes, stamp_ns: int) -> bytes:
    """Return a serialised message, whose first field is a header, with another stamp."""
    order = "<" if situation[1] & 1 else ">"
    stamp = struct.pack(f"{order}iI", *divmod(stamp_ns, SECOND_NS))
    return situation[:4] + stamp + situation[12:]


class _Asker:
    """Lets the time of a policy node go on, and publishes situations to it."""

    def __init__(self, node: Node) -> None:
        self.now_ns = 0
        self.decisions = Ear(node, topics.DECISION)
        self._clock = node.create_publisher(Clock, "/clock", 10)
        self._situations = node.create_publisher(
            topics.SITUATION.message, topics.SITUATION.name, topics.SITUATION.qos
        )

    def heard(self) -> bool:
        """Whether the node reads both topics."""
        publishers = (self._clock, self._situations)
        return all(publisher.get_subscription_count() > 0 for publisher in publishers)

    def is_loaded(self) -> bool:
        """Let half a second pass, and tell whether the policy is there."""
        self.now_ns += DECISION_PERIOD_NS
        self._clock.publish(Clock(clock=conversions.to_stamp(self.now_ns)))
        decision: Decision | None = self.decisions.newest()
        return decision is not None and decision.reason != Decision.POLICY_NOT_READY

    def ask(self, situation: bytes) -> float | None:
        """Let half a second pass; return how long the decision took [ms].

        None if the node missed the clock, or the decision is not the policy's.
        """
        self.now_ns += DECISION_PERIOD_NS
        stamp_ns, situation = self.now_ns, restamped(situation, self.now_ns)
        self._clock.publish(Clock(clock=conversions.to_stamp(stamp_ns)))
        time.sleep(_NOTICE_S)
        began_s = time.perf_counter()
        self._situations.publish(situation)
        arrival = self.decisions.wait(stamp_ns, _ANSWER_S)
        if arrival is None:
            return None
        decision = self.decisions.read(arrival)
        is_fault = Reason(decision.reason).is_fault
        if is_fault or conversions.to_ns(decision.situation_stamp) != stamp_ns:
            return None
        return 1e3 * (arrival.at_s - began_s)


def plain_work(count: int) -> Spread:
    """Return how long the same lines of Python take, each time after as long a pause.

    What they vary by is the computer's doing and nobody's that is measured here.
    """
    took = []
    with undisturbed():
        for _ in range(count):
            time.sleep(_NOTICE_S)
            began_s = time.perf_counter()
            sum(k * k for k in range(_WORK))
            took.append(1e3 * (time.perf_counter() - began_s))
    return spread(took[_WARM_UP:])


def answers(settings: RunSettings, asked: list[bytes], logs: Path) -> Spread:
    """Start a policy node and return how long its decisions take on these situations.

    Raises:
        NodeDiedError: it ended. SilentPlannerError: it did not answer.
    """
    policy = settings.planner_commands()[1]
    with ros_session("bench") as node, NodeGroup([policy], logs) as nodes:
        asker = _Asker(node)
        wait_until(asker.heard, "the policy node", START_S, nodes.check)
        wait_until(asker.is_loaded, "the policy", START_S, nodes.check)
        with undisturbed():
            took = [asker.ask(situation) for situation in asked]
        nodes.check()
    timed = [took_ms for took_ms in took[_WARM_UP:] if took_ms is not None]
    if len(timed) < (1.0 - _LOST) * len(took[_WARM_UP:]):
        raise SilentPlannerError(
            f"the policy node decided on {len(timed)} of {len(took) - _WARM_UP} situations"
        )
    return spread(timed)
