# SPDX-License-Identifier: Apache-2.0
"""Publishes the lane-based situation: subscribe, convert, call the core, publish."""

import time
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import PolygonStamped
from intersection_msgs.msg import PerceivedObjects, Route, Situation
from nav_msgs.msg import Odometry
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.ros import conversions, markers
from risk_dqn_planner.ros.clock import now_ns, on_clock_back, steady_timer
from risk_dqn_planner.ros.diagnostics import ERROR, OK, Diagnostics, freshness
from risk_dqn_planner.ros.main import run
from risk_dqn_planner.ros.parameters import EgoParameters, MapParameters, declare
from risk_dqn_planner.ros.qos import LATCHED, NEWEST
from risk_dqn_planner.ros.synchroniser import Fault, Frame, Input, Synchroniser, SynchroniserConfig
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.pipeline import SituationPipeline
from risk_dqn_planner.situation.report import SituationReport, Status, fault_status
from risk_dqn_planner.situation.warm_up import example_situation

# Faults are repeated at least at 2 Hz, by simulated and by real time.
WATCH_PERIOD_S = 0.25
QUIET_NS = 200_000_000
DIAGNOSTICS_PERIOD_S = 1.0


class SituationNode(Node):
    """Relates what is perceived to the lanes of the map, once for each list of objects."""

    def __init__(self) -> None:
        super().__init__("situation")
        self._map = declare(self, MapParameters)
        self._ego = declare(self, EgoParameters)
        self._sync_config = declare(self, SynchroniserConfig)
        situation = declare(self, SituationConfig)
        intersection = declare(
            self,
            IntersectionConfig,
            prefix="intersection.",
            given={"sensor_range_m": situation.sensor_range_m},
        )
        road_map = self._map.load()
        self._pipeline = SituationPipeline(
            lambda route: build_intersection(road_map, route, intersection), situation
        )
        self._synchroniser = Synchroniser(self._sync_config)
        self._status: Status | None = None
        self._sent_ns = self._sent_steady_ns = 0
        example_situation()  # compiles, so that the first message need not wait
        self._connect()
        self.get_logger().info(f"ready on {road_map.path}")

    def _connect(self) -> None:
        self._publisher = self.create_publisher(Situation, "~/output/situation", NEWEST)
        self._marker_publisher = self.create_publisher(MarkerArray, "~/debug/markers", NEWEST)
        self._diagnostics = Diagnostics(self, "planner")
        self._clock_back = on_clock_back(
            self, lambda: self._synchroniser.clock_went_back(now_ns(self))
        )
        self._timeout = steady_timer(self, self._sync_config.sync_timeout_s, self._advance)
        self._timeout.cancel()
        steady_timer(self, WATCH_PERIOD_S, self._watch)
        self.create_timer(WATCH_PERIOD_S, self._watch)
        steady_timer(self, DIAGNOSTICS_PERIOD_S, self._diagnose)
        for kind, source, name in (
            (Odometry, Input.ODOMETRY, "odometry"),
            (PolygonStamped, Input.VISIBLE_AREA, "visible_area"),
            (PerceivedObjects, Input.OBJECTS, "objects"),
        ):
            self.create_subscription(kind, f"~/input/{name}", self._receiver(source), NEWEST)
        self.create_subscription(Route, "~/input/route", self._on_route, LATCHED)

    def _receiver(self, source: Input) -> Callable[[Any], None]:
        def receive(message: Any) -> None:  # noqa: ANN401 (three kinds of messages)
            stamp_ns = conversions.to_ns(message.header.stamp)
            self._synchroniser.receive(source, stamp_ns, message, time.monotonic_ns())
            if source is Input.OBJECTS and self._timeout.is_canceled():
                self._timeout.reset()
            self._advance()

        return receive

    def _on_route(self, message: Route) -> None:
        route = conversions.route_from_message(message)
        if route == self._pipeline.route:
            return
        self._pipeline.select(route)
        model = self._pipeline.model
        for note in () if model is None else model.notes:
            self.get_logger().info(f"route {list(route)}: {note}")

    def _advance(self) -> None:
        """Publish what is due, if anything is."""
        due = self._synchroniser.take(time.monotonic_ns())
        if due is None:
            return
        self._timeout.cancel()
        if isinstance(due, Frame):
            self._evaluate(due)
        else:
            self._publish_fault(due)

    def _evaluate(self, frame: Frame) -> None:
        frame_id = self._map.map_frame
        try:
            seen = conversions.perception_from_messages(
                frame.odometry,
                frame.visible_area,
                frame.objects,
                frame_id,
                self._ego.base_to_center_m,
            )
            report = self._pipeline.report(frame.stamp_ns, seen)
        except PlannerError as error:
            self._publish_fault(Fault(frame.stamp_ns, fault_status(error), str(error)))
        except Exception as error:  # noqa: BLE001 (a vehicle stops, whatever an input does)
            text = f"internal error: {error!r}"
            self._publish_fault(Fault(frame.stamp_ns, Status.INVALID_INPUT, text))
        else:
            self._publish(report)
            model = self._pipeline.model
            if model is not None and self._marker_publisher.get_subscription_count() > 0:
                self._marker_publisher.publish(
                    markers.situation_markers(model, report, seen, frame_id)
                )

    def _publish_fault(self, fault: Fault) -> None:
        self._publish(self._pipeline.fault(*fault))

    def _publish(self, report: SituationReport) -> None:
        self._publisher.publish(conversions.situation_to_message(report, self._map.map_frame))
        self._sent_ns, self._sent_steady_ns = now_ns(self), time.monotonic_ns()
        if report.status is Status.OK and self._status is not Status.OK:
            self.get_logger().info("situation available")
        elif report.status is not self._status:
            self.get_logger().warning(f"{report.status.name}: {report.text}")
        self._status = report.status
        level = OK if report.status is Status.OK else ERROR
        self._diagnostics.set("situation", level, report.text or "available")

    def _watch(self) -> None:
        """Say what is missing, if nothing has been said for a while."""
        now, steady = now_ns(self), time.monotonic_ns()
        if max(now - self._sent_ns, steady - self._sent_steady_ns) < QUIET_NS:
            return
        fault = self._synchroniser.overdue(now)
        if fault is not None:
            self._publish_fault(fault)
        elif self._pipeline.model is None:
            self._publish(self._pipeline.route_report(now))

    def _diagnose(self) -> None:
        now = now_ns(self)
        for source in Input:
            age_s = self._synchroniser.age_s(source, now)
            level, text = freshness(age_s, self._sync_config.max_input_age_s)
            self._diagnostics.set(source.value, level, text, {"age_s": age_s})
        model = self._pipeline.model
        text = self._pipeline.route_fault or ("followed" if model else "never received")
        self._diagnostics.set(
            "route", OK if model else ERROR, text, {"lanelets": self._pipeline.route}
        )
        self._diagnostics.publish()


def main() -> int:
    """Run the node; the exit code."""
    return run("situation", SituationNode)
