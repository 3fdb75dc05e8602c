# SPDX-License-Identifier: Apache-2.0
"""Where the situation node's reports go: topic, RViz, log and diagnostics."""

import time

from intersection_msgs.msg import Situation
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from risk_dqn_planner.ros import markers
from risk_dqn_planner.ros.clock import now_ns
from risk_dqn_planner.ros.conversions import situation_to_message
from risk_dqn_planner.ros.diagnostics import ERROR, OK, STALE, WARN, Diagnostics, stream_status
from risk_dqn_planner.ros.qos import EACH, NEWEST
from risk_dqn_planner.ros.streams import InputRates, Stream
from risk_dqn_planner.ros.synchroniser import Synchroniser
from risk_dqn_planner.situation.inputs import Perception
from risk_dqn_planner.situation.pipeline import SituationPipeline
from risk_dqn_planner.situation.report import Fault, FaultyInput, SituationReport, Status


class SituationOutput:
    """Publishes reports and tells when the situation becomes available or ceases to be."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.frame_id = "map"
        self.rates = InputRates()
        self._publisher = node.create_publisher(Situation, "~/output/situation", EACH)
        self._marker_publisher = node.create_publisher(MarkerArray, "~/debug/markers", NEWEST)
        self._diagnostics = Diagnostics(node, "planner")
        self._told: tuple[Status, object] | None = None
        self._sent_ns = self._sent_steady_ns = 0

    def publish(self, report: SituationReport) -> None:
        """Publish a report, and log it if its fault differs from the last one's."""
        self._publisher.publish(situation_to_message(report, self.frame_id))
        self._sent_ns, self._sent_steady_ns = now_ns(self._node), time.monotonic_ns()
        fault = (report.status, report.source)
        if fault != self._told:
            if report.status is Status.OK:
                self._node.get_logger().info("situation available")
            else:
                self._node.get_logger().warning(f"{report.status.name}: {report.text}")
        self._told = fault
        level = OK if report.status is Status.OK else ERROR
        values = {"status": report.status.name, "faulty_input": report.source.name}
        self._diagnostics.set("situation", level, report.text or "available", values)

    def show(self, pipeline: SituationPipeline, report: SituationReport, seen: Perception) -> None:
        """Publish markers of a report, if anybody looks at them."""
        model = pipeline.model
        if model is not None and self._marker_publisher.get_subscription_count() > 0:
            places = pipeline.hidden_places
            shown = markers.situation_markers(model, report, seen, self.frame_id, places)
            self._marker_publisher.publish(shown)

    def silent_for(self, span_ns: int) -> bool:
        """Tell whether nothing has been published for this long, by simulated or by real time."""
        simulated_ns = now_ns(self._node) - self._sent_ns
        return max(simulated_ns, time.monotonic_ns() - self._sent_steady_ns) >= span_ns

    def diagnose(
        self,
        synchroniser: Synchroniser,
        pipeline: SituationPipeline | None,
        state: str,
        refusal: Fault | None,
    ) -> None:
        """Publish the state of the node and of each input."""
        level = OK if state == "active" else WARN
        text = state if refusal is None else f"{state}: {refusal.text}"
        self._diagnostics.set("node", level if refusal is None else ERROR, text)
        if state == "active" and pipeline is not None:
            for source, stream in synchroniser.streams.items():
                self.tell_of_input(source, stream)
            self.tell_of_route(pipeline)
        self._diagnostics.publish()

    def tell_of_recovered(self, synchroniser: Synchroniser) -> None:
        """Keep the diagnostics of inputs that were not well; a changed level goes out at once."""
        for source, stream in synchroniser.streams.items():
            if not self._diagnostics.is_well(str(source)):
                self.tell_of_input(source, stream)

    def tell_of_input(self, source: FaultyInput, stream: Stream) -> None:
        """Keep the diagnostics of an input; a changed level goes out at once."""
        level, text, values = stream_status(stream, now_ns(self._node), self.rates.of(source))
        self._diagnostics.set(str(source), level, text, values)

    def tell_of_route(self, pipeline: SituationPipeline) -> None:
        """Keep the diagnostics of the route; a changed level goes out at once."""
        followed, fault = pipeline.model is not None, pipeline.route_fault
        level = OK if followed else STALE if fault is None else ERROR
        text = "followed" if followed else str(fault or "never received")
        self._diagnostics.set("route", level, text, {"lanelets": pipeline.route})
