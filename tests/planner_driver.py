# SPDX-License-Identifier: Apache-2.0
"""Drives running planner nodes with hand-made inputs, in simulated time and in lock-step."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from intersection_msgs.msg import Decision, PerceivedObjects, Situation
from nav_msgs.msg import Odometry
from rclpy.node import Node

from risk_dqn_planner.intersection.model import ConflictPath, IntersectionModel
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.ros.qos import DIAGNOSTICS
from risk_dqn_planner.situation.inputs import EgoPose, object_arrays
from sim_bridge.ros import topics
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.pacing import LockStep, WallPace
from sim_bridge.ros.planner_link import DECISION_PERIOD_NS, PlannerLink
from sim_bridge.ros.session import wait_until

ANSWER_S = 10.0
START_S = 240.0


@dataclass(frozen=True)
class Vehicle:
    """A perceived vehicle on a path through a conflict zone, `distance_m` before its centre."""

    id: int
    path: ConflictPath
    distance_m: float
    speed_mps: float


@dataclass(frozen=True)
class Scene:
    """What the planner is told at one time.

    stop_line_m: the ego's stop position ahead of it. aside_m: the ego left of its path.
    seen_m: radius of the visible disc about the ego.
    """

    stop_line_m: float = 10.0
    ego_mps: float = 5.0
    aside_m: float = 0.0
    seen_m: float = 100.0
    vehicles: Sequence[Vehicle] = field(default_factory=tuple)
    frame: str = "map"

    def ego(self, model: IntersectionModel) -> EgoPose:
        """Pose of the ego's centre."""
        line = model.ego_path.centerline
        s = model.stop_line.position_m - self.stop_line_m
        (x, y), heading = line.position(s), line.heading_at(s)
        x, y = x - self.aside_m * math.sin(heading), y + self.aside_m * math.cos(heading)
        return EgoPose(x, y, heading, self.ego_mps)

    def odometry(self, model: IntersectionModel, stamp_ns: int) -> Odometry:
        """The ego as a message."""
        return conversions.ego_to_message(self.ego(model), stamp_ns, self.frame)

    def objects(self, stamp_ns: int) -> PerceivedObjects:
        """The other vehicles as a message."""
        rows = []
        for vehicle in self.vehicles:
            line = vehicle.path.path.centerline
            s = vehicle.path.zone_center_m - vehicle.distance_m
            rows.append((*line.position(s), line.heading_at(s), vehicle.speed_mps))
        ids = [vehicle.id for vehicle in self.vehicles]
        arrays = object_arrays(rows, ids, size_m=(4.0, 2.0))
        return conversions.objects_to_message(arrays, stamp_ns, self.frame)

    def visible_area(self, model: IntersectionModel, stamp_ns: int) -> object:
        """The visible disc as a message."""
        ego, turn = self.ego(model), np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        corners = np.column_stack(
            (ego.x_m + self.seen_m * np.cos(turn), ego.y_m + self.seen_m * np.sin(turn))
        )
        return conversions.area_to_message(corners, stamp_ns, self.frame)


class PlannerDriver:
    """Plays scenes to situation and policy node; time goes on from call to call."""

    def __init__(self, node: Node, nodes: NodeGroup, model: IntersectionModel) -> None:
        self.model = model
        self.nodes = nodes
        self.link = PlannerLink(node, topics.SITUATION.name, topics.DECISION.name)
        self.publishers = {
            topic.name: node.create_publisher(topic.message, topic.name, topic.qos)
            for topic in topics.INPUTS
        }
        self.now_ns = 0
        self.diagnostics: dict[str, DiagnosticStatus] = {}
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, DIAGNOSTICS)
        self._pacing = LockStep(self.link, WallPace(0.0), ANSWER_S)
        self.send_route(model.route)
        start_ns = self.link.meet(self._read, START_S)
        nodes.check()
        assert start_ns is not None, "the planner stays silent"
        self.now_ns = start_ns - DECISION_PERIOD_NS

    def _read(self) -> bool:
        self.nodes.check()
        return all(p.get_subscription_count() > 0 for p in self.publishers.values())

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self.diagnostics.update({status.name: status for status in message.status})

    def send_route(self, route: Sequence[int]) -> None:
        """Publish the ego's route, a new errand."""
        message = conversions.route_to_message(route, self.now_ns)
        self.publishers[topics.ROUTE.name].publish(message)

    def publish(self, scene: Scene, *, odometry: Odometry | None = None) -> None:
        """Publish a scene as of the present time; `odometry` replaces the scene's own."""
        own = scene.odometry(self.model, self.now_ns)
        self.publishers[topics.ODOMETRY.name].publish(odometry or own)
        area = scene.visible_area(self.model, self.now_ns)
        self.publishers[topics.VISIBLE_AREA.name].publish(area)
        self.publishers[topics.OBJECTS.name].publish(scene.objects(self.now_ns))

    def decide(self, scene: Scene, **replaced: Odometry) -> Decision:
        """Go on by half a second, publish a scene, and return the decision taken on it."""
        self.now_ns += DECISION_PERIOD_NS
        self.publish(scene, **replaced)
        self._pacing.reach(self.now_ns)
        return self._answer()

    def wait(self) -> Decision:
        """Go on by half a second without inputs and return the decision taken then."""
        self.now_ns += DECISION_PERIOD_NS
        self.link.tick(self.now_ns)
        return self._answer()

    def pause(self) -> None:
        """Let 3 s pass without inputs, so that the planner forgets what was before."""
        until_ns = self.now_ns + 6 * DECISION_PERIOD_NS
        self._pacing.pause(self.now_ns, until_ns)
        self.now_ns = until_ns - DECISION_PERIOD_NS

    def _answer(self) -> Decision:
        decision = None
        for _ in range(100):
            decision = self.link.decisions.wait(self.now_ns, ANSWER_S / 100)
            if decision is not None:
                break
            self.link.tick(self.now_ns)
        self.nodes.check()
        assert decision is not None, f"no decision at {self.now_ns} ns"
        return decision

    def situation(self) -> Situation:
        """Return the newest situation."""
        situation = self.link.situations.newest()[1]
        assert situation is not None
        return situation

    def wait_for(self, holds: Callable[[], bool]) -> None:
        """Wait until something else than a decision has arrived."""
        wait_until(holds, "the nodes to report", ANSWER_S, self.nodes.check)
