# SPDX-License-Identifier: Apache-2.0
"""Compares decisions taken on the same inputs at two times."""

from dataclasses import dataclass

from intersection_msgs.msg import Decision

from risk_dqn_planner.decision import Action, Reason
from risk_dqn_planner.policies.base import Supervision
from risk_dqn_planner.ros.conversions import SECOND_NS, to_ns


@dataclass(frozen=True)
class Difference:
    """A decision that came out otherwise than recorded; None: there was none in time."""

    recorded: Decision
    now: Decision | None

    def __str__(self) -> str:
        time_s = to_ns(self.recorded.header.stamp) / SECOND_NS
        now = _describe(self.now) if self.now is not None else "no decision in time"
        return f"t = {time_s:.1f} s: recorded {_describe(self.recorded)}; now {now}"


def _describe(decision: Decision) -> str:
    critical = ""
    if decision.critical_vehicle_id != Decision.NO_ID:
        critical += f", vehicle {decision.critical_vehicle_id}"
    if decision.critical_lane_id != Decision.NO_ID:
        critical += f", lane {decision.critical_lane_id}"
    if decision.supervisor != Decision.SUPERVISOR_OFF:
        verdict, proposed = Supervision(decision.supervisor).name, Action(decision.proposed).name
        critical += f", {proposed} {verdict}"
    action, reason = Action(decision.action).name, Reason(decision.reason).name
    return f"{action} ({reason}{critical}: {decision.text})"


def same(recorded: Decision, now: Decision) -> bool:
    """Whether two decisions do the same for the same reason."""
    return bool(
        recorded.action == now.action
        and recorded.reason == now.reason
        and recorded.critical_vehicle_id == now.critical_vehicle_id
        and recorded.critical_lane_id == now.critical_lane_id
        and recorded.supervisor == now.supervisor
        and recorded.proposed == now.proposed
    )


def difference(recorded: Decision, now: Decision | None) -> Difference | None:
    """Return how a decision differs from the recorded one, None if it does not."""
    if now is not None and same(recorded, now):
        return None
    return Difference(recorded, now)
