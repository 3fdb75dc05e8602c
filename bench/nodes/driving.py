# SPDX-License-Identifier: Apache-2.0
"""Traffic in real time, ten times a second, to situation and policy node.

Objects in to situation out: from before the first of the three messages is published (they are
serialised beforehand, as nobody knows what the sender is written in) until the situation of that
stamp arrives here. A situation that does not come before the next inputs counts as that long.

Decisions at 2 Hz: the time between two arrivals is compared with 0.5 s.
"""

import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from intersection_msgs.msg import Decision, Situation
from rclpy.node import Node
from rclpy.serialization import serialize_message

from bench.nodes.cores import bound_to, busy_loops
from bench.nodes.listening import Arrival, Ear, Spread, spread, undisturbed, uneven
from bench.nodes.scene import MovingScene
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.policies.base import Reason
from risk_dqn_planner.ros import conversions
from sim_bridge.ros import topics
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.ros.session import SilentPlannerError, ros_session, wait_until
from sim_bridge.ros.soak.processes import computed_s

PERIOD_S = 0.1
DECISION_PERIOD_S = 0.5
START_S = 240.0
SETTLE_S = 60.0  # at most
LOAD_SETTLES_S = 1.0


@dataclass(frozen=True)
class Drive:
    """What came of one drive.

    situation: objects in to situation out. uneven: how far intervals between decisions are from
    0.5 s. late: situations that came after the next inputs, or never. doubtful: situations that
    name a fault, and decisions that do. computed_ms: by node the processor time that went by for
    each set of inputs, all of its threads and timers together.
    """

    situation: Spread
    uneven: Spread
    late: int
    doubtful: int
    computed_ms: Mapping[str, float]


class Cores(NamedTuple):
    """Where this process runs, where the nodes do, and which cores are kept busy all the time."""

    own: frozenset[int]
    nodes: frozenset[int]
    busy: frozenset[int]


class Sender:
    """Publishes the inputs of the planner when they are due, and keeps when that was."""

    def __init__(self, node: Node, scene: MovingScene, route: Sequence[int]) -> None:
        self._publishers = [
            node.create_publisher(topic.message, topic.name, topic.qos) for topic in topics.INPUTS
        ]
        self._publishers[0].publish(conversions.route_to_message(route, 0))
        self._scene = scene
        self._count = 0
        self._began_s, self._began_ns = time.perf_counter(), time.time_ns()
        self.sent_s: dict[int, float] = {}
        self._next = self._prepare()

    def _prepare(self) -> list[bytes]:
        messages = self._scene.inputs(self._count * PERIOD_S, self.stamp_ns)
        return [serialize_message(message) for message in messages]

    @property
    def stamp_ns(self) -> int:
        """Stamp of the inputs that come next."""
        return self._began_ns + round(self._count * PERIOD_S * 1e9)

    def send(self) -> int:
        """Wait until inputs are due, publish them and return their stamp [ns]."""
        due_s = self._began_s + self._count * PERIOD_S
        time.sleep(max(0.0, due_s - time.perf_counter()))
        stamp_ns = self.stamp_ns
        self.sent_s[stamp_ns] = time.perf_counter()
        for publisher, data in zip(self._publishers[1:], self._next, strict=True):
            publisher.publish(data)
        return stamp_ns

    def prepare(self) -> None:
        """Make the next inputs; to be called when nothing else is awaited."""
        self._count += 1
        self._next = self._prepare()


def drive(
    settings: RunSettings,
    model: IntersectionModel,
    objects: int,
    duration_s: float,
    cores: Cores,
    logs: Path,
) -> Drive:
    """Start both nodes, play traffic for so long, and return what came of it.

    Cores are kept busy once both nodes have come up.

    Raises:
        NodeDiedError: a node ended. SilentPlannerError: the nodes never decided on this traffic.
    """
    real_time = replace(settings, overrides={**settings.overrides, "use_sim_time": False})
    with bound_to(cores.own), ros_session("bench") as node:
        group = NodeGroup(real_time.planner_commands(), logs)
        with ExitStack() as running:
            with bound_to(cores.nodes):
                nodes = running.enter_context(group)
            situations, decisions = Ear(node, topics.SITUATION), Ear(node, topics.DECISION)
            scene = MovingScene(model, objects, duration_s + SETTLE_S + LOAD_SETTLES_S, seed=1)
            wait_until(lambda: _is_loaded(decisions), "the policy", START_S, nodes.check)
            sender = Sender(node, scene, model.route)
            _settle(sender, situations, decisions, nodes)
            with busy_loops(cores.busy), undisturbed():
                _play(sender, situations, LOAD_SETTLES_S)
                for heard in (sender.sent_s, situations, decisions):
                    heard.clear()
                before_s = _computed_s(nodes)
                _play(sender, situations, duration_s)
                nodes.check()
                after_s = _computed_s(nodes)
    frames = len(sender.sent_s)
    computed_ms = {name: 1e3 * (after_s[name] - before_s[name]) / frames for name in before_s}
    return _summary(sender, situations, decisions, computed_ms)


def _computed_s(nodes: NodeGroup) -> dict[str, float]:
    return {name: computed_s(pid) for name, pid in nodes.pids().items()}


def _is_loaded(decisions: Ear) -> bool:
    decision: Decision | None = decisions.newest()
    return decision is not None and decision.reason != Decision.POLICY_NOT_READY


def _settle(sender: Sender, situations: Ear, decisions: Ear, nodes: NodeGroup) -> None:
    """Play until decisions are the policy's own."""
    for _ in range(round(SETTLE_S)):
        _play(sender, situations, 1.0)
        nodes.check()
        decision: Decision = decisions.newest()
        if not Reason(decision.reason).is_fault:
            return
    raise SilentPlannerError(f"the planner does not decide on the traffic: {decision.text}")


def _play(sender: Sender, situations: Ear, duration_s: float) -> None:
    for _ in range(round(duration_s / PERIOD_S)):
        stamp_ns = sender.send()
        situations.wait(stamp_ns, 0.7 * PERIOD_S)
        sender.prepare()


def _summary(
    sender: Sender, situations: Ear, decisions: Ear, computed_ms: Mapping[str, float]
) -> Drive:
    arrived: dict[int, Arrival] = {a.stamp_ns: a for a in situations.all()}
    waits_ms = [
        1e3 * (arrived[stamp].at_s - sent_s) if stamp in arrived else 1e3 * PERIOD_S
        for stamp, sent_s in sender.sent_s.items()
    ]
    reports = [situations.read(arrival) for arrival in arrived.values()]
    choices = [decisions.read(arrival) for arrival in decisions.all()]
    return Drive(
        situation=spread(waits_ms),
        uneven=spread(uneven([a.at_s for a in decisions.all()], DECISION_PERIOD_S)),
        late=sum(wait_ms >= 1e3 * PERIOD_S for wait_ms in waits_ms),
        doubtful=sum(r.status != Situation.OK for r in reports)
        + sum(Reason(c.reason).is_fault for c in choices),
        computed_ms=computed_ms,
    )
