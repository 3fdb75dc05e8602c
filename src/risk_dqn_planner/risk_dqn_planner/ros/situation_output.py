# SPDX-License-Identifier: Apache-2.0
"""Where the situation node's reports go: topic, log and diagnostics."""

import time

from intersection_msgs.msg import Situation
from rclpy.node import Node

from risk_dqn_planner.ros.clock import now_ns
from risk_dqn_planner.ros.conversions import situation_to_message
from risk_dqn_planner.ros.diagnostics import ERROR, OK, Diagnostics, freshness
from risk_dqn_planner.ros.qos import NEWEST
from risk_dqn_planner.ros.synchroniser import Input, Synchroniser
from risk_dqn_planner.situation.pipeline import SituationPipeline
from risk_dqn_planner.situation.report import SituationReport, Status


class SituationOutput:
    """Publishes reports and tells when the situation becomes available or ceases to be."""

    def __init__(self, node: Node, frame_id: str) -> None:
        self._node = node
        self._frame_id = frame_id
        self._publisher = node.create_publisher(Situation, "~/output/situation", NEWEST)
        self._diagnostics = Diagnostics(node, "planner")
        self._status: Status | None = None
        self._sent_ns = self._sent_steady_ns = 0

    def publish(self, report: SituationReport) -> None:
        """Publish a report, and log it if its status differs from the last one's."""
        self._publisher.publish(situation_to_message(report, self._frame_id))
        self._sent_ns, self._sent_steady_ns = now_ns(self._node), time.monotonic_ns()
        if report.status is not self._status:
            if report.status is Status.OK:
                self._node.get_logger().info("situation available")
            else:
                self._node.get_logger().warning(f"{report.status.name}: {report.text}")
        self._status = report.status
        level = OK if report.status is Status.OK else ERROR
        self._diagnostics.set("situation", level, report.text or "available")

    def silent_for(self, span_ns: int) -> bool:
        """Tell whether nothing has been published for this long, by simulated or by real time."""
        simulated_ns = now_ns(self._node) - self._sent_ns
        return max(simulated_ns, time.monotonic_ns() - self._sent_steady_ns) >= span_ns

    def diagnose(
        self, synchroniser: Synchroniser, pipeline: SituationPipeline, max_age_s: float
    ) -> None:
        """Publish the state of each input."""
        now = now_ns(self._node)
        for source in Input:
            age_s = synchroniser.age_s(source, now)
            level, text = freshness(age_s, max_age_s)
            self._diagnostics.set(source.value, level, text, {"age_s": age_s})
        followed = pipeline.model is not None
        text = "followed" if followed else str(pipeline.route_fault or "never received")
        level = OK if followed else ERROR
        self._diagnostics.set("route", level, text, {"lanelets": pipeline.route})
        self._diagnostics.publish()
