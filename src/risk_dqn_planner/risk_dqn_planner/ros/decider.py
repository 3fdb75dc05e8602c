# SPDX-License-Identifier: Apache-2.0
"""When a policy may be asked, and what is decided when it may not: plain Python, without ROS 2."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.decision import Decision, Reason, fault_decision
from risk_dqn_planner.faults import FaultyInput
from risk_dqn_planner.policies.base import Decisions, Policy
from risk_dqn_planner.situation.report import SituationReport, Status
from risk_dqn_planner.situation.situations import Situations
from risk_dqn_planner.vehicle import require_positive

SECOND_NS = 1_000_000_000

Explain = Callable[[Decisions, Situations, int, Policy], Decision]


@dataclass(frozen=True)
class DeciderConfig:
    """How old a situation may be, and after what gap earlier ones are forgotten."""

    max_situation_age_s: float = field(
        default=0.5,
        metadata={
            "description": "An older situation is answered with Stop [s]",
            "minimum": 0.01,
            "maximum": 10.0,
        },
    )
    max_history_gap_s: float = field(
        default=0.75,
        metadata={
            "description": "After a longer gap between situations the history starts anew [s]",
            "minimum": 0.01,
            "maximum": 10.0,
        },
    )

    def __post_init__(self) -> None:
        require_positive(self)


class UnusablePolicy(NamedTuple):
    """Stands for a policy that could not be loaded, or is not loaded yet: its name, and why."""

    name: str
    fault: str
    hash: str = ""
    reason: Reason = Reason.POLICY_REFUSED


class Choice(NamedTuple):
    """A decision and the time of the situation it was taken on [ns], None without one."""

    decision: Decision
    situation_stamp_ns: int | None


class Decider:
    """Decides on the newest report; whatever is doubtful is answered with Stop and its reason."""

    def __init__(
        self,
        policy: Policy | UnusablePolicy,
        explain: Explain,
        config: DeciderConfig,
        *,
        restart_after_fault: bool = False,
    ) -> None:
        """Ask `policy`; `explain` puts its answers into words.

        restart_after_fault: the policy counts on what it decided having been carried out, as
        supervisors do, so that a Stop in between which was not its own makes its memory void.
        """
        self._policy = policy
        self._restart_after_fault = restart_after_fault
        self._interrupted = False  # by such a Stop, since the policy was asked last
        self._explain = explain
        self._max_age_ns = int(config.max_situation_age_s * SECOND_NS)
        self._max_gap_ns = int(config.max_history_gap_s * SECOND_NS)
        self._report: SituationReport | None = None
        self._decided: SituationReport | None = None  # what the policy saw last
        self._choice: Choice | None = None  # its answer to that

    def receive(self, report: SituationReport) -> None:
        """Take the newest report."""
        self._report = report

    def has_reached(self, stamp_ns: int) -> bool:
        """Tell whether the newest report is of this time or later."""
        return self._report is not None and self._report.stamp_ns >= stamp_ns

    def forget(self) -> None:
        """Start the policy's history anew, for instance because the clock went back."""
        self._decided = None
        self._choice = None

    def decide(self, now_ns: int) -> Choice:
        """Return the decision at a time on the clock of the stamps [ns]."""
        if isinstance(self._policy, UnusablePolicy):
            return self._stop(self._policy.reason, FaultyInput.POLICY, self._policy.fault)
        report = self._report
        if report is None:
            text = "no situation received yet"
            return self._stop(Reason.MISSING_INPUT, FaultyInput.SITUATION, text)
        return self._doubt(report, now_ns) or self._answer(self._policy, report)

    def _answer(self, policy: Policy, report: SituationReport) -> Choice:
        if report.situations is None:
            return self._stop(Reason(report.status), report.source, report.text, report)
        if self._choice is not None and self._repeats(report):
            # Asking again would put the same scene into the policy's history twice.
            return self._choice
        try:
            self._choice = self._ask(policy, report, report.situations)
        except Exception as error:  # noqa: BLE001 (a vehicle stops, whatever a policy does)
            self.forget()
            text = f"policy {policy.name} failed: {type(error).__name__}: {error}"
            text = " ".join(text.split())
            return self._stop(Reason.POLICY_FAILED, FaultyInput.POLICY, text, report)
        self._decided = report
        return self._choice

    def _doubt(self, report: SituationReport, now_ns: int) -> Choice | None:
        """Return Stop if the report is too old, ahead of its time or out of order."""
        age_s = (now_ns - report.stamp_ns) / SECOND_NS
        limit_s = self._max_age_ns / SECOND_NS
        if now_ns - report.stamp_ns > self._max_age_ns:
            text = f"the situation is {age_s:.2f} s old, expected at most {limit_s:g} s"
            return self._stop(Reason.STALE_INPUT, FaultyInput.SITUATION, text, report)
        if report.stamp_ns - now_ns > self._max_age_ns:
            text = f"the situation is {-age_s:.2f} s ahead of the clock"
            return self._stop(Reason.FUTURE_INPUT, FaultyInput.SITUATION, text, report)
        # Faults bear the clock's time, situations that of the objects: only these must rise.
        decided = self._decided if report.status is Status.OK else None
        if decided is not None and report.stamp_ns < decided.stamp_ns:
            back_s = (decided.stamp_ns - report.stamp_ns) / SECOND_NS
            self.forget()
            text = f"the situation went back in time by {back_s:.3f} s"
            return self._stop(Reason.OUT_OF_ORDER_INPUT, FaultyInput.SITUATION, text, report)
        return None

    def _repeats(self, report: SituationReport) -> bool:
        last = self._decided
        return last is not None and report.stamp_ns == last.stamp_ns and report.route == last.route

    def _ask(self, policy: Policy, report: SituationReport, situations: Situations) -> Choice:
        last = self._decided
        restart = (
            last is None
            or report.route != last.route
            or report.stamp_ns - last.stamp_ns > self._max_gap_ns
            or (self._interrupted and self._restart_after_fault)
        )
        self._interrupted = False
        decisions = policy.decide(situations, np.array([restart]))
        decision = self._explain(decisions, situations, 0, policy)
        return Choice(decision, report.stamp_ns)

    def _stop(
        self,
        reason: Reason,
        source: FaultyInput,
        text: str,
        report: SituationReport | None = None,
    ) -> Choice:
        self._interrupted = True
        decision = fault_decision(reason, text, self._policy.name, self._policy.hash, source)
        return Choice(decision, None if report is None else report.stamp_ns)
