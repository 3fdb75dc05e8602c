# SPDX-License-Identifier: Apache-2.0
"""Publishes the lane-based situation: subscribe, convert, call the core, publish."""

import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from geometry_msgs.msg import PolygonStamped
from intersection_msgs.msg import Route
from nav_msgs.msg import Odometry
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.ros import conversions, markers
from risk_dqn_planner.ros.adapters.kinds import ObjectsAdapter
from risk_dqn_planner.ros.clock import is_simulated, now_ns, on_clock_back, steady_timer
from risk_dqn_planner.ros.main import run
from risk_dqn_planner.ros.parameters import (
    ClockParameters,
    EgoParameters,
    MapParameters,
    declare,
)
from risk_dqn_planner.ros.qos import LATCHED, NEWEST
from risk_dqn_planner.ros.situation_output import SituationOutput
from risk_dqn_planner.ros.synchroniser import Frame, Input, Synchroniser, SynchroniserConfig
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.pipeline import SituationPipeline
from risk_dqn_planner.situation.report import Fault, FaultyInput, Status, fault_of
from risk_dqn_planner.situation.warm_up import example_situation

# Faults are repeated at least at 2 Hz, by simulated and by real time.
WATCH_PERIOD_S = 0.25
SILENCE_NS = 200_000_000
DIAGNOSTICS_PERIOD_S = 1.0


class SituationNode(Node):
    """Relates what is perceived to the lanes of the map, once for each list of objects."""

    def __init__(self) -> None:
        super().__init__("situation")
        self._map = declare(self, MapParameters)
        self._ego = declare(self, EgoParameters)
        self._objects = declare(self, ObjectsAdapter)
        self._sync_config = self._declare_synchroniser()
        self._synchroniser = Synchroniser(self._sync_config)
        self._pipeline = self._declare_pipeline()
        self._output = SituationOutput(self, self._map.map_frame)
        self._marker_publisher = self.create_publisher(MarkerArray, "~/debug/markers", NEWEST)
        self._start_timers()
        self._subscribe()
        self.get_logger().info(f"ready on {self._map.map_file}")

    def _declare_synchroniser(self) -> SynchroniserConfig:
        config = declare(self, SynchroniserConfig)
        patience_s = declare(self, ClockParameters).sim_time_patience_s
        if is_simulated(self):
            return replace(config, sync_timeout_s=max(config.sync_timeout_s, patience_s))
        return config

    def _declare_pipeline(self) -> SituationPipeline:
        situation = declare(self, SituationConfig)
        given = {"sensor_range_m": situation.sensor_range_m}
        intersection = declare(self, IntersectionConfig, prefix="intersection.", given=given)
        road_map = self._map.load()
        example_situation(situation)  # compiles, so that the first message need not wait
        return SituationPipeline(
            lambda route: build_intersection(road_map, route, intersection), situation
        )

    def _start_timers(self) -> None:
        self._clock_back = on_clock_back(
            self, lambda: self._synchroniser.clock_went_back(now_ns(self))
        )
        self._timeout = steady_timer(self, self._sync_config.sync_timeout_s, self._advance)
        self._timeout.cancel()
        steady_timer(self, WATCH_PERIOD_S, self._watch)
        self.create_timer(WATCH_PERIOD_S, self._watch)
        steady_timer(self, DIAGNOSTICS_PERIOD_S, self._diagnose)

    def _subscribe(self) -> None:
        for kind, source, name in (
            (Odometry, Input.ODOMETRY, "odometry"),
            (PolygonStamped, Input.VISIBLE_AREA, "visible_area"),
            (self._objects.message_type(), Input.OBJECTS, "objects"),
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
        """Publish the situation of a frame, or why there is none."""
        base_to_center_m = self._ego.base_to_center_m
        try:
            seen = conversions.perception_from_messages(
                *frame[1:], self._map.map_frame, base_to_center_m, self._objects
            )
            report = self._pipeline.report(frame.stamp_ns, seen)
        except PlannerError as error:
            self._publish_fault(fault_of(frame.stamp_ns, error))
        except Exception as error:  # noqa: BLE001 (a vehicle stops, whatever an input does)
            self.get_logger().error(traceback.format_exc(), throttle_duration_sec=10.0)
            text = f"internal error: {error!r}"
            self._publish_fault(
                Fault(frame.stamp_ns, Status.INTERNAL_ERROR, FaultyInput.NO_INPUT, text)
            )
        else:
            self._output.publish(report)
            model = self._pipeline.model
            if model is not None and self._marker_publisher.get_subscription_count() > 0:
                shown = markers.situation_markers(model, report, seen, self._map.map_frame)
                self._marker_publisher.publish(shown)

    def _publish_fault(self, fault: Fault) -> None:
        self._output.publish(self._pipeline.fault(fault))

    def _watch(self) -> None:
        """Say what is missing, if nothing has been said for a while."""
        if not self._output.silent_for(SILENCE_NS):
            return
        now = now_ns(self)
        fault = self._synchroniser.overdue(now)
        if fault is not None:
            self._publish_fault(fault)
        elif self._pipeline.model is None:
            self._output.publish(self._pipeline.route_report(now))

    def _diagnose(self) -> None:
        self._output.diagnose(self._synchroniser, self._pipeline, self._sync_config.max_input_age_s)


def main() -> int:
    """Run the node; the exit code."""
    return run("situation", SituationNode)
