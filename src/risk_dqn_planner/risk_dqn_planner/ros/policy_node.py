# SPDX-License-Identifier: Apache-2.0
"""Publishes a decision twice a second, whatever the inputs do."""

import os
import traceback
from functools import partial

import numpy as np
from intersection_msgs.msg import Decision, Situation
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from risk_dqn_planner.decision import Reason, explain
from risk_dqn_planner.errors import InputError, PolicyError
from risk_dqn_planner.policies.base import Policy
from risk_dqn_planner.policies.supervised import SupervisorMode, supervisor_mode
from risk_dqn_planner.policies.supervised_loading import SOUND, config_of, load_supervised
from risk_dqn_planner.ros import conversions, markers
from risk_dqn_planner.ros.background import spinning
from risk_dqn_planner.ros.clock import is_simulated, now_ns, on_clock_back, steady_timer
from risk_dqn_planner.ros.decider import Choice, Decider, DeciderConfig, UnusablePolicy
from risk_dqn_planner.ros.diagnostics import ERROR, OK, Diagnostics
from risk_dqn_planner.ros.main import run
from risk_dqn_planner.ros.parameters import (
    ClockParameters,
    PolicyParameters,
    declare,
    declare_assumptions,
)
from risk_dqn_planner.ros.qos import NEWEST
from risk_dqn_planner.situation.report import SituationReport
from risk_dqn_planner.situation.warm_up import example_situation

DIAGNOSTICS_PERIOD_S = 1.0


class PolicyNode(Node):
    """Asks a policy about the newest situation; what is doubtful is answered with Stop."""

    def __init__(self) -> None:
        super().__init__("policy")
        self._settings = declare(self, PolicyParameters)
        self._mode = supervisor_mode(self._settings.supervisor)
        self._assumptions = declare_assumptions(self, self._settings.rate_hz)
        self._explain = partial(
            explain, config=config_of(self._assumptions), assumptions=self._assumptions
        )
        config = declare(self, DeciderConfig)
        patience_s = declare(self, ClockParameters).sim_time_patience_s
        self._patient = is_simulated(self) and patience_s > 0.0
        self._patience = steady_timer(self, patience_s, self._decide_now)
        self._patience.cancel()
        self._reason: Reason | None = None
        self._due_ns: int | None = None  # time of a decision that waits for its situation
        self._diagnostics = Diagnostics(self, "planner")
        if is_simulated(self):
            # Its clock waits for a planner that is ready: before, there is no time to decide at.
            policy = self._load()
            self._decider = self._decide_by(policy, config)
            self._speak()
        else:
            self._decider = self._decide_by(self._not_yet(), config)
            self._speak()
            with spinning(self):
                policy = self._load()
            self._decider = self._decide_by(policy, config)
        self._clock_back = on_clock_back(self, self._decider.forget)
        self.create_subscription(Situation, "~/input/situation", self._on_situation, NEWEST)
        self.get_logger().info(f"ready with policy {policy.name}")

    def _decide_by(self, policy: Policy | UnusablePolicy, config: DeciderConfig) -> Decider:
        supervised = self._mode is not SupervisorMode.OFF or self._settings.policy in SOUND
        return Decider(policy, self._explain, config, restart_after_fault=supervised)

    def _speak(self) -> None:
        """Begin to decide twice a second, and to tell about it."""
        self._publisher = self.create_publisher(Decision, "~/output/decision", NEWEST)
        self._marker_publisher = self.create_publisher(MarkerArray, "~/debug/markers", NEWEST)
        # On the node's clock: with simulated time, decisions fall on multiples of the period.
        self.create_timer(1.0 / self._settings.rate_hz, self._on_tick)
        steady_timer(self, DIAGNOSTICS_PERIOD_S, self._diagnostics.publish)

    def _not_yet(self) -> UnusablePolicy:
        """Stand in for the policy while torch is loaded and the check perhaps compiled."""
        name = self._settings.policy
        text = f"policy {name} is still being loaded"
        return UnusablePolicy(name, text, reason=Reason.POLICY_NOT_READY)

    def _load(self) -> Policy | UnusablePolicy:
        """Load the policy and let it decide twice, so that the first real decision is not late.

        A vehicle whose policy is broken must hear Stop, not silence.
        """
        name = self._settings.policy
        try:
            policy = load_supervised(name, self._mode, self._assumptions)
            for restart in (True, False):
                situations = example_situation()
                decisions = policy.decide(situations, np.array([restart]))
                self._explain(decisions, situations, 0, policy)
        except PolicyError as error:
            fault = str(error)
        except Exception as error:  # noqa: BLE001 (a vehicle stops, whatever a policy does)
            self.get_logger().error(traceback.format_exc())
            fault = f"policy {name} failed: {type(error).__name__}: {error}"
        else:
            return policy
        fault = " ".join(fault.split())
        self.get_logger().error(f"{fault}; every decision will be Stop")
        return UnusablePolicy(name, fault)

    def _on_situation(self, message: Situation) -> None:
        try:
            report = conversions.situation_from_message(message)
        except InputError as error:
            stamp_ns = conversions.to_ns(message.header.stamp)
            report = SituationReport(stamp_ns, error.kind, str(error), source=error.source)
        self._decider.receive(report)
        if self._due_ns is not None and self._decider.has_reached(self._due_ns):
            self._decide_now()

    def _on_tick(self) -> None:
        """Decide; in simulated time only once the situation of this very moment is there.

        Clock and situation are different topics, and either may win the race.
        """
        self._decide_now()
        self._due_ns = now_ns(self)
        if self._patient and not self._decider.has_reached(self._due_ns):
            self._patience.reset()
        else:
            self._decide_now()

    def _decide_now(self) -> None:
        """Take the decision that is due, if one is."""
        self._patience.cancel()
        if self._due_ns is not None:
            self._decide(self._due_ns)
        self._due_ns = None

    def _decide(self, stamp_ns: int) -> None:
        choice = self._decider.decide(stamp_ns)
        message = conversions.decision_to_message(
            choice.decision, stamp_ns, choice.situation_stamp_ns
        )
        self._publisher.publish(message)
        self._tell(choice)
        if self._marker_publisher.get_subscription_count() > 0:
            frame_id = self._settings.marker_frame
            self._marker_publisher.publish(
                markers.decision_markers(choice.decision, stamp_ns, frame_id)
            )

    def _tell(self, choice: Choice) -> None:
        """Log when decisions begin or cease to be the policy's own, and keep diagnostics."""
        decision = choice.decision
        faulty = decision.reason.is_fault
        was_faulty = self._reason is None or self._reason.is_fault
        if faulty and decision.reason is not self._reason:
            self.get_logger().warning(decision.text)
        elif was_faulty and not faulty:
            self.get_logger().info("deciding")
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
        self._diagnostics.set("decision", ERROR if faulty else OK, decision.text, values)


def main() -> int:
    """Run the node; the exit code."""
    # One decision is too small to share among threads of torch; sharing would only vary its time.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    return run("policy", PolicyNode)
