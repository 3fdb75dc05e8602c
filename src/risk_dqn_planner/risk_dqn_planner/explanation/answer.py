# SPDX-License-Identifier: Apache-2.0
"""One of a batch of decisions, as plain values."""

import math
from dataclasses import dataclass
from typing import NamedTuple

from risk_dqn_planner.policies.base import Action, Decisions, Reason, Supervision

NOBODY = -1
_UNSOUND = (Supervision.OBJECTED, Supervision.OVERRULED)


class Pair(NamedTuple):
    """Indices of a vehicle (-1: one that may hide) and of its lane (-1: there is none)."""

    vehicle: int
    lane: int


class Checked(NamedTuple):
    """What the check of soundness says of one action; see `JointCheck`."""

    admissible: bool
    periods: int
    margin_s: float
    whom: Pair


@dataclass(frozen=True)
class Answer:
    """What a policy, and whoever checks it, says.

    named: whom they name. checked: by Action, None where nobody checked. in_force: the action
    before. lacking_s: what the check says is missing, 0 nothing; NaN where others decided.
    """

    action: Action
    reason: Reason
    supervision: Supervision
    proposed: Action | None
    named: Pair
    checked: tuple[Checked, ...] | None
    in_force: Action
    lacking_s: float

    @property
    def is_unsound(self) -> bool:
        """Whether a supervisor says so."""
        return self.supervision in _UNSOUND

    @property
    def considered(self) -> Action:
        """The action to be explained: the faster one not taken, or the one found unsound."""
        if self.is_unsound and self.proposed is not None:
            return self.proposed
        return Action(min(self.action + 1, Action.FAST))

    @property
    def is_told_by_check(self) -> bool:
        """Whether the check of soundness decided; otherwise Algorithm 1's prediction tells."""
        return self.checked is not None and not math.isnan(self.lacking_s)

    @property
    def concerns_others(self) -> bool:
        """Whether anybody but the ego has a part in it."""
        if self.reason is Reason.FIXED:
            return self.is_unsound
        return self.reason is not Reason.GOAL_REACHED


def answer_of(decisions: Decisions, index: int) -> Answer:
    """Take one decision out of a batch."""
    supervision, proposed = Supervision.OFF, None
    if decisions.supervision is not None and decisions.proposed is not None:
        supervision = Supervision(int(decisions.supervision[index]))
        proposed = Action(int(decisions.proposed[index]))
    in_force, lacking_s = Action.STOP, math.nan
    if decisions.in_force is not None:
        in_force = Action(int(decisions.in_force[index]))
    if decisions.lacking_s is not None:
        lacking_s = float(decisions.lacking_s[index])
    return Answer(
        action=Action(int(decisions.action[index])),
        reason=Reason(int(decisions.reason[index])),
        supervision=supervision,
        proposed=proposed,
        named=Pair(int(decisions.critical_vehicle[index]), int(decisions.critical_lane[index])),
        checked=_checked(decisions, index),
        in_force=in_force,
        lacking_s=lacking_s,
    )


def _checked(decisions: Decisions, index: int) -> tuple[Checked, ...] | None:
    check = decisions.check
    if check is None:
        return None
    rows = zip(*(field[index].tolist() for field in check), strict=True)
    return tuple(
        Checked(admissible, periods, margin_s, Pair(vehicle, lane))
        for admissible, periods, margin_s, vehicle, lane in rows
    )
