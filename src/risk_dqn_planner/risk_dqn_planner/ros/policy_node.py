# SPDX-License-Identifier: Apache-2.0
"""Publishes a decision twice a second, whatever the inputs do."""

import os
import time
import traceback
from dataclasses import replace
from functools import partial

import numpy as np
from intersection_msgs.msg import Situation

from risk_dqn_planner.decision import Reason, explain, fault_decision
from risk_dqn_planner.errors import ConfigurationError, InputError, PlannerError, PolicyError
from risk_dqn_planner.explanation.warm_up import warm_up
from risk_dqn_planner.faults import FaultyInput
from risk_dqn_planner.policies.base import Policy
from risk_dqn_planner.policies.supervised import Supervisor, SupervisorMode, supervisor_mode
from risk_dqn_planner.policies.supervised_loading import config_of, is_sound, load_supervised
from risk_dqn_planner.policies.trust import ANYTHING, listed
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.ros.assumed_times import AssumedTimes
from risk_dqn_planner.ros.clock import allowed_lead_s, now_ns, on_clock_back
from risk_dqn_planner.ros.decider import (
    Choice,
    Decider,
    DeciderConfig,
    Explain,
    Trouble,
    UnusablePolicy,
)
from risk_dqn_planner.ros.decision_output import DecisionOutput
from risk_dqn_planner.ros.diagnostics import ERROR, OK, WARN
from risk_dqn_planner.ros.lifecycle import ManagedNode
from risk_dqn_planner.ros.main import run_managed
from risk_dqn_planner.ros.parameters import (
    ClockParameters,
    PolicyParameters,
    StandingClockParameters,
    add_assumptions,
    read_assumptions,
)
from risk_dqn_planner.ros.qos import EACH
from risk_dqn_planner.ros.situation_records import SituationRecords, read_situation
from risk_dqn_planner.ros.streams import RATES, SituationRates
from risk_dqn_planner.ros.ticker import Ticker
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.report import SituationReport
from risk_dqn_planner.situation.warm_up import example_situation


class PolicyNode(ManagedNode):
    """Asks a policy about the newest situation; what is doubtful is answered with Stop.

    It decides while it is active. Where nobody else takes it through its life it also says Stop
    before that: while the policy is loaded, and for ever if it cannot be.
    """

    def __init__(self) -> None:
        super().__init__("policy")
        for config in (PolicyParameters, DeciderConfig, ClockParameters, StandingClockParameters):
            self.declared.add(config)
        self.declared.add(SituationRates, RATES)
        add_assumptions(self.declared)
        self.declared.guard()
        self._supervisor: Supervisor | None = None
        self._sound = False
        self._output = DecisionOutput(self, PolicyParameters.marker_frame)
        self._decider = self._undecided("is still being loaded")
        self._stand_in: Decider | None = None  # decides where the policy must not yet
        self._ticker = Ticker(self, self)
        self._clock_back = on_clock_back(self, lambda: self._decider.clock_went_back(now_ns(self)))
        self.create_subscription(Situation, "~/input/situation", self._on_situation, EACH, raw=True)
        if self.autostart:
            self._tick()

    def _tick(self) -> None:
        """Begin to decide, as the parameters say."""
        names = ("rate_hz", "sim_time_patience_s", "clock_timeout_s")
        rate_hz, patience_s, timeout_s = (self.get_parameter(name).value for name in names)
        self._ticker.clock_timeout_s = timeout_s
        self._ticker.start(rate_hz, patience_s)

    def _undecided(self, what: str) -> Decider:
        """Return what says Stop for want of a policy."""
        name = str(self.get_parameter("policy").value)
        text = f"policy {name} {what}"
        return _stand_in(name, Reason.POLICY_NOT_READY, FaultyInput.POLICY, text)

    def configure(self) -> None:
        """Load the policy and let it decide twice, so that the first real decision is not late."""
        settings = self.declared.read(PolicyParameters)
        _require_situations_for(settings.rate_hz, self.declared.read(SituationRates, RATES))
        assumptions = read_assumptions(self.declared, settings.rate_hz)
        config = self.declared.read(DeciderConfig)
        self.declared.read(ClockParameters)
        self.declared.read(StandingClockParameters)
        explains = partial(explain, config=config_of(assumptions), assumptions=assumptions)
        policy = _load(settings, assumptions, explains)
        warm_up(config_of(assumptions), assumptions)
        self._supervisor = policy if isinstance(policy, Supervisor) else None
        self._sound = is_sound(policy)
        self._stand_in = self._undecided("is loaded, but the node is not active")
        self._decider = Decider(policy, explains, config)
        self.reconfigure()
        text = f"policy {policy.name}"
        self._output.diagnostics.set("policy", OK, text, {"hash": policy.hash})

    def refuse(self, error: PlannerError) -> None:
        """Say Stop and why, where the node takes itself through its life."""
        reason, source = Reason.POLICY_REFUSED, FaultyInput.POLICY
        if isinstance(error, ConfigurationError):
            reason, source = Reason.NOT_CONFIGURED, FaultyInput.PARAMETERS
        text, name = " ".join(str(error).split()), str(self.get_parameter("policy").value)
        self._decider, self._stand_in = _stand_in(name, reason, source, text), None
        if self.autostart and not self._ticker.running:
            self._tick()
        self._output.diagnostics.set("policy", ERROR, text, {"reason": reason.name})

    def reconfigure(self) -> None:
        """Go by the present values of what may change at any time."""
        settings = self.declared.read(PolicyParameters)
        config = self.declared.read(DeciderConfig)
        lead_s = allowed_lead_s(self, config.max_situation_ahead_s)
        # What was decided is checked for one period: it does not serve the next decision as well.
        repeat_s = min(config.max_repeat_s, 0.5 / settings.rate_hz)
        self._decider.reconfigure(
            replace(config, max_situation_ahead_s=lead_s, max_repeat_s=repeat_s)
        )
        self._ticker.clock_timeout_s = self.declared.read(StandingClockParameters).clock_timeout_s
        self._output.marker_frame = settings.marker_frame
        self._output.rates = self.declared.read(SituationRates, RATES)
        mode = supervisor_mode(settings.supervisor)
        supervised = mode is not SupervisorMode.OFF or self._sound
        self._decider.restart_after_fault = supervised
        if self._supervisor is not None and self._supervisor.mode is not mode:
            self._supervisor.mode = mode
            self._decider.forget()  # what was verified before is not what was carried out
        assumed = AssumedTimes.of(read_assumptions(self.declared, settings.rate_hz))
        self._output.assumed = assumed if supervised else None

    def activate(self) -> None:
        """Begin to decide."""
        self._decider.forget()  # somebody else may have decided since
        self._stand_in = None
        self._tick()
        self.get_logger().info(f"ready with policy {self._decider.policy.name}")

    def deactivate(self) -> None:
        """Fall silent: somebody else decides, or nobody."""
        self._ticker.stop()

    def clean_up(self) -> None:
        """Forget the policy."""
        self._supervisor = self._stand_in = None
        self._decider = self._undecided("is not loaded")
        self._output.diagnostics.set("policy", WARN, "unconfigured")

    def _on_situation(self, data: bytes) -> None:
        try:
            message = read_situation(data)
        except ValueError as error:
            # It counts as not received, as one that rclpy cannot read does.
            text = f"a situation cannot be read: {error}"
            self.get_logger().error(text, throttle_duration_sec=10.0)
            return
        try:
            report = conversions.situation_from_records(message)
        except InputError as error:
            report = _unusable(message, error)
        except Exception as error:  # noqa: BLE001 (a vehicle stops, whatever an input does)
            self.get_logger().error(traceback.format_exc(), throttle_duration_sec=10.0)
            report = _unusable(message, PlannerError(_internal(error)))
        self._decider.receive(report, now_ns(self), time.monotonic_ns())
        self._ticker.situation_came()

    def has_reached(self, stamp_ns: int) -> bool:
        """Tell whether the situation of this time or a later one is there."""
        return self._decider.has_reached(stamp_ns)

    def clock_stands(self, stamp_ns: int, stood_s: float) -> None:
        """Say Stop although no time passes."""
        reason, text = Reason.FROZEN_INPUT, f"the clock has stood still for {stood_s:.1f} s"
        if stamp_ns == 0:
            reason, text = Reason.MISSING_INPUT, "no time received on /clock yet"
        self._decide(stamp_ns, Trouble(reason, FaultyInput.CLOCK, text))

    def decide(self, stamp_ns: int) -> None:
        """Take the decision of a time."""
        self._decide(stamp_ns)

    def _decide(self, stamp_ns: int, trouble: Trouble | None = None) -> None:
        """Take a decision, whatever happens."""
        decider = self._stand_in or self._decider
        try:
            choice = decider.decide(stamp_ns, time.monotonic_ns(), trouble)
            self._output.publish(choice, stamp_ns)
        except Exception as error:  # noqa: BLE001 (a vehicle stops, whatever fails)
            self.get_logger().error(traceback.format_exc(), throttle_duration_sec=10.0)
            decider.forget()
            choice = Choice(fault_decision(Reason.INTERNAL_ERROR, _internal(error)), None)
            self._output.publish(choice, stamp_ns)
        self._output.tell(choice, stamp_ns, decider.stream)


def _unusable(message: SituationRecords, error: PlannerError) -> SituationReport:
    return SituationReport(
        conversions.to_ns(message.header.stamp),
        error.kind,
        str(error),
        tuple(message.route.tolist()),
        source=error.source,
        route_stamp_ns=conversions.to_ns(message.route_stamp),
    )


def _internal(error: Exception) -> str:
    """Return words for an error of our own, in characters that every message can hold."""
    return f"internal error: {' '.join(ascii(error).split())}"


def _stand_in(name: str, reason: Reason, source: FaultyInput, text: str) -> Decider:
    stand_in = UnusablePolicy(name, text, reason=reason, source=source)
    return Decider(stand_in, explain, DeciderConfig())


def _require_situations_for(rate_hz: float, rates: SituationRates) -> None:
    """Raise ConfigurationError unless each decision may have a situation of its own.

    A rate of situations of 0 says that nothing is known of it.
    """
    if 0.0 < rates.situation.min_rate_hz < rate_hz:
        raise ConfigurationError(
            f"rate_hz is {rate_hz:g}, expected at most rates.situation.min_rate_hz "
            f"({rates.situation.min_rate_hz:g}), to be raised if perception is that fast: each "
            "decision needs a new situation"
        )


def _load(settings: PolicyParameters, assumptions: SafetyAssumptions, explains: Explain) -> Policy:
    """Return a policy that has decided already.

    Raises:
        PlannerError: it cannot be used.
    """
    name = settings.policy
    try:
        # A supervisor that is off may be switched on later.
        trust = listed(settings.trusted_policies) if name.endswith(".pt") else ANYTHING
        if settings.allow_unlisted_policy:
            trust = ANYTHING
        policy = load_supervised(name, SupervisorMode.REPORT, assumptions, trust)
        if isinstance(policy, Supervisor):
            policy.mode = supervisor_mode(settings.supervisor)
        for restart in (True, False):
            situations = example_situation()
            decisions = policy.decide(situations, np.array([restart]))
            explains(decisions, situations, 0, policy)
    except PlannerError:
        raise
    except Exception as error:
        text = f"policy {name} failed: {type(error).__name__}: {error}"
        raise PolicyError(" ".join(text.split())) from error
    return policy


def main() -> int:
    """Run the node; the exit code."""
    # One decision is too small to share among threads of torch; sharing would only vary its time.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    return run_managed("policy", PolicyNode)
