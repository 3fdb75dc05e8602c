# SPDX-License-Identifier: Apache-2.0
"""Compares decisions taken on the same inputs at two times."""

from dataclasses import dataclass

from intersection_msgs.msg import Decision

from risk_dqn_planner.decision import Action, Reason
from risk_dqn_planner.faults import FaultyInput
from risk_dqn_planner.policies.base import Supervision
from risk_dqn_planner.ros.conversions import to_ns
from risk_dqn_planner.ros.streams import SECOND_NS

NOTHING_IN_TIME = "no decision in time"


@dataclass(frozen=True)
class Difference:
    """A decision that came out otherwise than recorded; None: there was none in time."""

    recorded: Decision
    now: Decision | None

    def __str__(self) -> str:
        now = NOTHING_IN_TIME if self.now is None else _with_text(self.now)
        return f"t = {time_of(self.recorded)} s: recorded {_with_text(self.recorded)}; now {now}"


def time_of(decision: Decision) -> str:
    """Return when a decision was taken, in seconds with one digit."""
    return f"{to_ns(decision.header.stamp) / SECOND_NS:.1f}"


def described(decision: Decision) -> str:
    """Return everything about a decision that must not change, in one line."""
    parts = [Action(decision.action).name, Reason(decision.reason).name]
    if decision.faulty_input != Decision.NO_INPUT:
        parts.append(f"of {FaultyInput(decision.faulty_input)}")
    if decision.critical_vehicle_id != Decision.NO_ID:
        parts.append(f"vehicle {decision.critical_vehicle_id}")
    if decision.critical_lane_id != Decision.NO_ID:
        parts.append(f"lane {decision.critical_lane_id}")
    if decision.supervisor != Decision.SUPERVISOR_OFF:
        verdict, proposed = Supervision(decision.supervisor).name, Action(decision.proposed).name
        parts.append(f"{proposed} {verdict}")
    return ", ".join(parts)


def _with_text(decision: Decision) -> str:
    return f"{described(decision)} ({decision.text})"


def difference(recorded: Decision, now: Decision | None) -> Difference | None:
    """Return how a decision differs from the recorded one, None if it does not.

    The text is left out: its numbers may differ in their last digits.
    """
    if now is not None and described(recorded) == described(now):
        return None
    return Difference(recorded, now)
