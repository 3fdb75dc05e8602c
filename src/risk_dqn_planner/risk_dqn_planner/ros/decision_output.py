# SPDX-License-Identifier: Apache-2.0
"""Where decisions go: topic, RViz, log and diagnostics."""

import os

from intersection_msgs.msg import Decision
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from risk_dqn_planner.decision import Reason
from risk_dqn_planner.faults import FaultyInput
from risk_dqn_planner.policies.base import Supervision
from risk_dqn_planner.ros import conversions, markers
from risk_dqn_planner.ros.assumed_times import AssumedTimes, Gaps
from risk_dqn_planner.ros.clock import now_ns, steady_timer
from risk_dqn_planner.ros.decider import Choice
from risk_dqn_planner.ros.diagnostics import ERROR, OK, WARN, Diagnostics, stream_status
from risk_dqn_planner.ros.qos import NEWEST
from risk_dqn_planner.ros.streams import SituationRates, Stream

_DIAGNOSTICS_PERIOD_S = 1.0


class DecisionOutput:
    """Publishes decisions and tells when they begin or cease to be the policy's own."""

    def __init__(self, node: Node, marker_frame: str) -> None:
        self._node = node
        self.marker_frame = marker_frame
        self.rates = SituationRates()
        self.assumed: AssumedTimes | None = None  # of situations, by the supervisor
        self._gaps = Gaps()
        self._publisher = node.create_publisher(Decision, "~/output/decision", NEWEST)
        self._marker_publisher = node.create_publisher(MarkerArray, "~/debug/markers", NEWEST)
        self.diagnostics = Diagnostics(node, "planner")
        self._reason: Reason | None = None
        self._stream: Stream | None = None
        steady_timer(node, _DIAGNOSTICS_PERIOD_S, self._diagnose)

    def publish(self, choice: Choice, stamp_ns: int) -> None:
        """Publish a decision taken at a time.

        Raises:
            Exception: it cannot be put into a message; nothing was published.
        """
        message = conversions.decision_to_message(
            choice.decision, stamp_ns, choice.situation_stamp_ns
        )
        self._publisher.publish(message)
        # Linux may have put whoever waits for it behind this very thread: let it run first.
        os.sched_yield()

    def tell(self, choice: Choice, stamp_ns: int, stream: Stream) -> None:
        """Tell of a decision everywhere else; `stream`: the situations it is taken on."""
        self._stream = stream
        # After a fault the supervisor counts on nothing from before.
        asked = not choice.decision.reason.is_fault
        self._gaps.note(choice.situation_stamp_ns if asked else None, self.assumed)
        self._tell(choice)
        at_fault = choice.decision.faulty_input is FaultyInput.SITUATION
        if at_fault or not self.diagnostics.is_well("situation"):
            self._tell_of_situations(stream)
        if self._marker_publisher.get_subscription_count() > 0:
            shown = markers.decision_markers(choice.decision, stamp_ns, self.marker_frame)
            self._marker_publisher.publish(shown)

    def _tell(self, choice: Choice) -> None:
        """Log changes between the policy and faults, and keep the diagnostics."""
        decision = choice.decision
        was_fault = self._reason is None or self._reason.is_fault
        if decision.reason.is_fault and decision.reason is not self._reason:
            self._node.get_logger().warning(f"{decision.reason.name}: {decision.text}")
        elif was_fault and not decision.reason.is_fault:
            self._node.get_logger().info("deciding")
        self._reason = decision.reason
        values = {
            "action": decision.action.name,
            "reason": decision.reason.name,
            "faulty_input": decision.faulty_input.name,
            "policy": decision.policy_name,
            "policy_hash": decision.policy_hash,
            "supervisor": decision.supervision.name,
        }
        if decision.proposed is not None:
            values["proposed"] = decision.proposed.name
        level = ERROR if decision.reason.is_fault else OK
        if decision.supervision is Supervision.OBJECTED:
            level = max(level, WARN)
        self.diagnostics.set("decision", level, decision.text, values)

    def _diagnose(self) -> None:
        if self._stream is not None:
            self._tell_of_situations(self._stream)
        self.diagnostics.publish()

    def _tell_of_situations(self, stream: Stream) -> None:
        """Keep the diagnostics of the situations; a changed level goes out at once."""
        now = now_ns(self._node)
        level, text, values = stream_status(stream, now, self.rates.situation)
        if level == OK and self.assumed is not None:
            objection = self.assumed.objection_to_age(stream.age_s(now)) or self._gaps.take()
            level, text = (WARN, objection) if objection else (level, text)
        self.diagnostics.set("situation", level, text, values)
