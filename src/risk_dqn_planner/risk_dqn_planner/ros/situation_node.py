# SPDX-License-Identifier: Apache-2.0
"""Publishes the lane-based situation: subscribe, convert, call the core, publish."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from geometry_msgs.msg import PolygonStamped
from intersection_msgs.msg import Route
from nav_msgs.msg import Odometry
from rclpy.subscription import Subscription

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.faults import FaultyInput
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.ros import conversions, markers
from risk_dqn_planner.ros.adapters.kinds import ObjectsAdapter
from risk_dqn_planner.ros.clock import (
    allowed_lead_s,
    is_simulated,
    now_ns,
    on_clock_back,
    steady_timer,
)
from risk_dqn_planner.ros.evaluation import Evaluation
from risk_dqn_planner.ros.lifecycle import ManagedNode
from risk_dqn_planner.ros.main import run_managed
from risk_dqn_planner.ros.parameters import ClockParameters, EgoParameters, MapParameters
from risk_dqn_planner.ros.qos import LATCHED, NEWEST
from risk_dqn_planner.ros.records import RecordReader
from risk_dqn_planner.ros.situation_output import SituationOutput
from risk_dqn_planner.ros.streams import RATES, SECOND_NS, AgeLimits, InputRates
from risk_dqn_planner.ros.synchroniser import Frame, Synchroniser, SynchroniserConfig
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.limits import PlausibilityLimits
from risk_dqn_planner.situation.pipeline import SituationPipeline
from risk_dqn_planner.situation.plausibility import Plausibility
from risk_dqn_planner.situation.report import Fault, SituationReport, Status, fault_of
from risk_dqn_planner.situation.warm_up import example_perception, example_situation

# Faults are repeated at least at 2 Hz, by simulated and by real time.
WATCH_PERIOD_S = 0.25
SILENCE_NS = 200_000_000
DIAGNOSTICS_PERIOD_S = 1.0
_INTERSECTION, _PLAUSIBILITY = "intersection.", "plausibility."
_RANGE = "sensor_range_m"  # the intersection's is the situation's


class SituationNode(ManagedNode):
    """Relates what is perceived to the lanes of the map, once for each list of objects.

    It does so while it is active. Where nobody else takes it through its life, it says why it
    cannot be configured.
    """

    def __init__(self) -> None:
        super().__init__("situation")
        for config in (
            MapParameters, EgoParameters, ObjectsAdapter, AgeLimits, SynchroniserConfig,
            ClockParameters, SituationConfig,
        ):  # fmt: skip
            self.declared.add(config)
        self.declared.add(IntersectionConfig, _INTERSECTION, (_RANGE,))
        self.declared.add(PlausibilityLimits, _PLAUSIBILITY)
        self.declared.add(InputRates, RATES)
        self.declared.guard()
        self._working = False
        self._refusal: Fault | None = None
        self._evaluation: Evaluation | None = None
        self._inputs: list[Subscription] = []
        self._synchroniser = Synchroniser(SynchroniserConfig(), AgeLimits())
        self._output = SituationOutput(self)
        self._timeout = steady_timer(self, WATCH_PERIOD_S, self._advance)
        self._timeout.cancel()
        self._clock_back = on_clock_back(self, self._on_clock_back)
        steady_timer(self, WATCH_PERIOD_S, self._watch)
        self.create_timer(WATCH_PERIOD_S, self._watch)
        steady_timer(self, DIAGNOSTICS_PERIOD_S, self._diagnose)

    def configure(self) -> None:
        """Load the map, compile what is needed and subscribe to the inputs."""
        maps, ego = self.declared.read(MapParameters), self.declared.read(EgoParameters)
        objects = self.declared.read(ObjectsAdapter)
        situation = self.declared.read(SituationConfig)
        given = {_RANGE: situation.sensor_range_m}
        intersection = self.declared.read(IntersectionConfig, _INTERSECTION, given)
        objects_type = objects.message_type()
        road_map = maps.load()
        pipeline = SituationPipeline(
            lambda route: build_intersection(road_map, route, intersection), situation
        )
        # Compile, so that the first message need not wait.
        example_situation(situation)
        markers.warm_up()
        Plausibility().check(example_perception(), 0.0, 0.0)
        self._evaluation = Evaluation(maps, ego, objects, pipeline, Plausibility(), self._complain)
        self._output.frame_id = maps.map_frame
        self.reconfigure()
        self._subscribe(objects_type, objects.reader)
        self._refusal = None

    def refuse(self, error: PlannerError) -> None:
        """Say why there will be no situation, where the node takes itself through its life."""
        self._refusal = fault_of(0, error)

    def reconfigure(self) -> None:
        """Go by the present values of what may change at any time."""
        config, ages = self.declared.read(SynchroniserConfig), self.declared.read(AgeLimits)
        patience_s = self.declared.read(ClockParameters).sim_time_patience_s
        ages = replace(ages, max_input_ahead_s=allowed_lead_s(self, ages.max_input_ahead_s))
        if is_simulated(self):
            config = replace(config, sync_timeout_s=max(config.sync_timeout_s, patience_s))
        self._synchroniser.reconfigure(config, ages)
        self._timeout.timer_period_ns = round(SECOND_NS * config.sync_timeout_s)
        self._output.rates = self.declared.read(InputRates, RATES)
        limits = self.declared.read(PlausibilityLimits, _PLAUSIBILITY)
        if self._evaluation is not None:
            self._evaluation.plausibility.limits = limits

    def activate(self) -> None:
        """Begin to publish situations; what came before does not count."""
        self._synchroniser.restart()
        if self._evaluation is not None:
            self._evaluation.plausibility.forget()
        self._working = True
        self.get_logger().info(f"ready on {self.get_parameter('map_file').value}")

    def deactivate(self) -> None:
        """Fall silent."""
        self._working = False
        self._timeout.cancel()

    def clean_up(self) -> None:
        """Forget the map."""
        for subscription in self._inputs:
            self.destroy_subscription(subscription)
        self._inputs, self._evaluation, self._refusal = [], None, None

    def _subscribe(self, objects_type: type, read_objects: RecordReader | None) -> None:
        # First, so that inputs which come at the same time are those of the new errand.
        route = self.create_subscription(Route, "~/input/route", self._on_route, LATCHED)
        self._inputs.append(route)
        for kind, source, name, read in (
            (Odometry, FaultyInput.ODOMETRY, "odometry", None),
            (PolygonStamped, FaultyInput.VISIBLE_AREA, "visible_area", conversions.read_area),
            (objects_type, FaultyInput.OBJECTS, "objects", read_objects),
        ):
            receive, raw = self._receiver(source, read), read is not None
            topic = f"~/input/{name}"
            self._inputs.append(self.create_subscription(kind, topic, receive, NEWEST, raw=raw))

    def _receiver(self, source: FaultyInput, read: RecordReader | None) -> Callable[[Any], None]:
        def receive(message: Any) -> None:  # noqa: ANN401 (three kinds of messages)
            if not self._working:
                return
            if read is not None:
                try:
                    message = read(message)
                except ValueError as error:
                    # It counts as not received, as one that rclpy cannot read does.
                    self._complain(f"{source} cannot be read: {error}")
                    return
            stamp_ns = conversions.to_ns(message.header.stamp)
            now, steady = now_ns(self), time.monotonic_ns()
            self._synchroniser.receive(source, stamp_ns, message, now, steady)
            if source is FaultyInput.OBJECTS and self._timeout.is_canceled():
                self._timeout.reset()
            self._advance()

        return receive

    def _on_route(self, message: Route) -> None:
        """Begin an errand; who waits for that hears of it, even where inputs do not come."""
        evaluation = self._evaluation
        route = conversions.route_from_message(message)
        stamp_ns = conversions.to_ns(message.header.stamp)
        if evaluation is None or not evaluation.begin(route, stamp_ns):
            return
        self._synchroniser.begin_errand()
        model = evaluation.pipeline.model
        for note in () if model is None else model.notes:
            self.get_logger().info(f"route {list(route)}: {note}")
        self._say_what_is_missing()
        if self._working:
            self._output.tell_of_route(evaluation.pipeline)

    def _advance(self) -> None:
        """Publish what is due, if anything is."""
        evaluation = self._evaluation
        if evaluation is None or not self._working:
            return
        due = self._synchroniser.take(now_ns(self), time.monotonic_ns())
        if due is None:
            return
        self._timeout.cancel()
        if isinstance(due, Frame):
            report, seen = evaluation.report(due)
            self._publish(report)
            if seen is not None:
                self._output.show(evaluation.pipeline, report, seen)
        else:
            self._publish(evaluation.fault(due))

    def _publish(self, report: SituationReport) -> None:
        self._output.publish(report)
        if report.status is Status.OK:
            self._output.tell_of_recovered(self._synchroniser)
        stream = self._synchroniser.streams.get(report.source)
        if stream is not None:
            stream.note(Fault(report.stamp_ns, report.status, report.source, report.text))
            self._output.tell_of_input(report.source, stream)

    def _watch(self) -> None:
        """Say what is missing, if nothing has been said for a while."""
        if not self._output.silent_for(SILENCE_NS):
            return
        if self._working:
            self._say_what_is_missing()
        elif self._refusal is not None and self.autostart:
            _, status, source, text = self._refusal
            self._output.publish(SituationReport(now_ns(self), status, text, source=source))

    def _say_what_is_missing(self) -> None:
        evaluation, now = self._evaluation, now_ns(self)
        if evaluation is None or not self._working:
            return
        fault = self._synchroniser.overdue(now, time.monotonic_ns())
        if fault is not None:
            self._publish(evaluation.fault(fault))
        elif evaluation.pipeline.model is None:
            self._publish(evaluation.pipeline.route_report(now))

    def _on_clock_back(self) -> None:
        self._synchroniser.clock_went_back(now_ns(self))
        if self._evaluation is not None:
            self._evaluation.plausibility.forget()

    def _complain(self, text: str) -> None:
        self.get_logger().error(text, throttle_duration_sec=10.0)

    def _diagnose(self) -> None:
        pipeline = None if self._evaluation is None else self._evaluation.pipeline
        self._output.diagnose(self._synchroniser, pipeline, self.state_name(), self._refusal)


def main() -> int:
    """Run the node; the exit code."""
    return run_managed("situation", SituationNode)
