# SPDX-License-Identifier: Apache-2.0
"""When a policy may be asked, and what is decided when it may not: plain Python, without ROS 2.

Whatever is doubtful is answered with Stop and its reason, at once; after it, all must be good for
a while before the policy is asked again, so that decisions do not flicker.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.decision import Decision, Reason, fault_decision
from risk_dqn_planner.errors import InputError
from risk_dqn_planner.faults import FaultyInput
from risk_dqn_planner.policies.base import Decisions, Policy
from risk_dqn_planner.ros.streams import SECOND_NS, AgeLimits, Stream
from risk_dqn_planner.situation.report import Fault, SituationReport, Status
from risk_dqn_planner.situation.situations import Situations
from risk_dqn_planner.vehicle import require_in_range

Explain = Callable[[Decisions, Situations, int, Policy], Decision]

# What says nothing against inputs that come later: a new errand begins without it.
_SETTLED_BY_ERRAND = frozenset(
    (
        Reason.MISSING_INPUT, Reason.STALE_INPUT, Reason.FROZEN_INPUT, Reason.BAD_ROUTE,
        Reason.OFF_ROUTE, Reason.WRONG_WAY, Reason.NOT_CONFIGURED,
    )
)  # fmt: skip


@dataclass(frozen=True)
class DeciderConfig:
    """How old a situation may be, and when decisions and histories go on after a fault."""

    max_situation_age_s: float = field(
        default=0.5,
        metadata={
            "description": "An older situation is answered with Stop [s]",
            "minimum": 0.01,
            "maximum": 10.0,
            "live": True,
        },
    )
    max_situation_ahead_s: float = field(
        default=0.2,
        metadata={
            "description": "A situation further ahead of the clock is answered with Stop [s]",
            "minimum": 0.0,
            "maximum": 10.0,
            "live": True,
        },
    )
    max_repeat_s: float = field(
        default=0.25,
        metadata={
            "description": "A situation that was decided on longer ago, or more than half a "
            "period, is frozen: Stop [s]",
            "minimum": 0.0,
            "maximum": 10.0,
            "live": True,
        },
    )
    max_history_gap_s: float = field(
        default=0.75,
        metadata={
            "description": "After a longer gap between situations the history starts anew [s]",
            "minimum": 0.01,
            "maximum": 10.0,
            "live": True,
        },
    )
    recovery_s: float = field(
        default=1.0,
        metadata={
            "description": "After a fault all must be good for this long before the policy is "
            "asked again [s]",
            "minimum": 0.0,
            "maximum": 60.0,
            "live": True,
        },
    )

    def __post_init__(self) -> None:
        require_in_range(self)

    @property
    def ages(self) -> AgeLimits:
        """The limits of situations as those of any input."""
        return AgeLimits(self.max_situation_age_s, self.max_situation_ahead_s)


class UnusablePolicy(NamedTuple):
    """Stands for a policy that could not be loaded, or is not loaded yet: its name, and why."""

    name: str
    fault: str
    hash: str = ""
    reason: Reason = Reason.POLICY_REFUSED
    source: FaultyInput = FaultyInput.POLICY


class Choice(NamedTuple):
    """A decision and the time of the situation it was taken on [ns], None without one."""

    decision: Decision
    situation_stamp_ns: int | None


class Trouble(NamedTuple):
    """Why the policy may not be asked."""

    reason: Reason
    source: FaultyInput
    text: str


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
        self.policy = policy
        self.restart_after_fault = restart_after_fault
        self._interrupted = False  # by such a Stop, since the policy was asked last
        self._explain = explain
        self.config = config
        self.stream = Stream(FaultyInput.SITUATION, config.ages)  # of reports without a fault
        self._report: SituationReport | None = None
        self._errand: tuple[tuple[int, ...], int] | None = None
        self._started = False  # the policy has been asked on this errand
        self._decided: SituationReport | None = None  # what the policy saw last
        self._decided_ns = 0  # when it saw that first
        self._choice: Choice | None = None  # its answer to that
        self._trouble: Trouble | None = None  # the last one, as long as it bears on decisions
        self._good_since_ns: int | None = None  # stamp of the first good report after it
        self._untold: Trouble | None = None  # one that no decision has told of yet

    def reconfigure(self, config: DeciderConfig) -> None:
        """Go by other limits from now on."""
        self.config, self.stream.limits = config, config.ages

    def receive(self, report: SituationReport, now_ns: int, steady_ns: int = 0) -> None:
        """Take the newest report; times are those of the stamps' clock and of the steady one."""
        self._report = report
        errand = (report.route, report.route_stamp_ns)
        if errand != self._errand:
            self._begin(errand)
        if report.situations is None:
            self.doubt(Trouble(Reason(report.status), report.source, report.text))
            return
        fault = self.stream.receive(report.stamp_ns, report, now_ns, steady_ns)
        if fault is not None:
            self.doubt(_as_trouble(fault))
            if fault.status is Status.OUT_OF_ORDER_INPUT:
                self.forget()
        elif self._good_since_ns is None:
            self._good_since_ns = report.stamp_ns

    def has_reached(self, stamp_ns: int) -> bool:
        """Tell whether the newest report is of this time or later."""
        return self._report is not None and self._report.stamp_ns >= stamp_ns

    def forget(self) -> None:
        """Start the policy's history anew."""
        self._decided = None
        self._choice = None

    def clock_went_back(self, now_ns: int) -> None:
        """Start anew, forgetting what is of a time that has not come yet."""
        self.forget()
        self._started = False
        latest_ns = now_ns + self.stream.limits.max_age_ns
        self.stream.forget_later_than(latest_ns)
        if self._report is not None and self._report.stamp_ns > latest_ns:
            self._report = None
        if self._good_since_ns is not None:
            self._good_since_ns = min(self._good_since_ns, now_ns)

    def doubt(self, trouble: Trouble) -> None:
        """Take note of trouble: the next decision tells of it, and recovery begins after it.

        It begins with the next good report and not with the last complaint: how often a fault is
        complained of depends on how busy the computer is.
        """
        if trouble.reason in _SETTLED_BY_ERRAND and not self._started:
            return  # this is how every errand begins
        self._trouble = self._untold = trouble
        self._good_since_ns = None

    def decide(self, now_ns: int, steady_ns: int = 0, trouble: Trouble | None = None) -> Choice:
        """Return the decision at a time on the clock of the stamps [ns].

        trouble: what else speaks against asking the policy now.
        """
        policy, report = self.policy, self._report
        if isinstance(policy, UnusablePolicy):
            return self._stop(Trouble(policy.reason, policy.source, policy.fault))
        present = trouble or self._present(now_ns, steady_ns)
        if present is not None:
            self.doubt(present)
        told = present or self._untold or self._recovering(now_ns)
        self._untold = None
        if told is not None:
            return self._stop(told, report)
        return self._answer(policy, now_ns)

    def _begin(self, errand: tuple[tuple[int, ...], int]) -> None:
        """Begin an errand: what happened on the one before bears on nothing."""
        self._errand, self._started = errand, False
        self.forget()
        if self._trouble is not None and self._trouble.reason in _SETTLED_BY_ERRAND:
            self._trouble = self._untold = None

    def _present(self, now_ns: int, steady_ns: int) -> Trouble | None:
        """Return why the newest report cannot be decided on."""
        report = self._report
        if report is not None and report.situations is None:
            if now_ns - report.stamp_ns <= self.config.ages.max_age_ns:
                return Trouble(Reason(report.status), report.source, report.text)
            age_s = (now_ns - report.stamp_ns) / SECOND_NS
            text = f"nothing heard of the situation for {age_s:.2f} s; last: {report.text}"
            return Trouble(Reason.STALE_INPUT, FaultyInput.SITUATION, text)
        fault = self.stream.overdue(now_ns, now_ns, steady_ns)
        if fault is not None:
            return _as_trouble(fault)
        since_ns = now_ns - self._decided_ns
        if self._repeats() and since_ns > round(self.config.max_repeat_s * SECOND_NS):
            text = f"no new situation since the one decided on {since_ns / SECOND_NS:.2f} s ago"
            return Trouble(Reason.FROZEN_INPUT, FaultyInput.SITUATION, text)
        return None

    def _recovering(self, now_ns: int) -> Trouble | None:
        """Return why it is too early to ask the policy again."""
        if self._trouble is None:
            return None
        since_ns = now_ns if self._good_since_ns is None else self._good_since_ns
        good_s = (now_ns - since_ns) / SECOND_NS
        if good_s >= self.config.recovery_s:
            self._trouble = None
            return None
        text = f"good for {good_s:.1f} of {self.config.recovery_s:g} s after: {self._trouble.text}"
        return Trouble(Reason.RECOVERING, self._trouble.source, text)

    def _repeats(self) -> bool:
        """Whether the policy has seen the newest report already."""
        last, report = self._decided, self._report
        return last is not None and report is not None and report.stamp_ns == last.stamp_ns

    def _answer(self, policy: Policy, now_ns: int) -> Choice:
        report = self._report
        if report is None or report.situations is None:
            raise InputError("situation: there is none", source=FaultyInput.SITUATION)
        if self._choice is not None and self._repeats():
            # Asking again would put the same scene into the policy's history twice.
            return self._choice
        try:
            self._choice = self._ask(policy, report, report.situations)
        except Exception as error:  # noqa: BLE001 (a vehicle stops, whatever a policy does)
            self.forget()
            text = f"policy {policy.name} failed: {type(error).__name__}: {error}"
            failed = Trouble(Reason.POLICY_FAILED, FaultyInput.POLICY, " ".join(text.split()))
            self.doubt(failed)
            self._untold = None
            return self._stop(failed, report)
        self._decided, self._decided_ns, self._started = report, now_ns, True
        return self._choice

    def _ask(self, policy: Policy, report: SituationReport, situations: Situations) -> Choice:
        last = self._decided
        max_gap_ns = round(self.config.max_history_gap_s * SECOND_NS)
        restart = (
            last is None
            or report.stamp_ns - last.stamp_ns > max_gap_ns
            or (self._interrupted and self.restart_after_fault)
        )
        self._interrupted = False
        decisions = policy.decide(situations, np.array([restart]))
        decision = self._explain(decisions, situations, 0, policy)
        return Choice(decision, report.stamp_ns)

    def _stop(self, why: Trouble, report: SituationReport | None = None) -> Choice:
        self._interrupted = True
        decision = fault_decision(
            why.reason, why.text, self.policy.name, self.policy.hash, why.source
        )
        return Choice(decision, None if report is None else report.stamp_ns)


def _as_trouble(fault: Fault) -> Trouble:
    return Trouble(Reason(fault.status), fault.source, fault.text)
