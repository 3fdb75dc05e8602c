# SPDX-License-Identifier: Apache-2.0
"""The one place where words are made, from published fields alone: fields and words agree."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from risk_dqn_planner.explanation.fields import Critical, Explanation, Verdict
from risk_dqn_planner.policies.base import Action, Reason, Supervision

_SAME_LANE = (Critical.AHEAD, Critical.BEHIND)
_CHECKS = {
    Supervision.OVERRULED: "supervisor overrules {}",
    Supervision.OBJECTED: "supervisor objects",
}


class Facts(NamedTuple):
    """The fields of a decision that its words are made from.

    vehicle_id, lane_id: whom `why` is about, None nobody. q_values: by Action. proposed: the
    policy's own action where a supervisor checked it.
    """

    action: Action
    reason: Reason
    why: Explanation
    vehicle_id: int | None
    lane_id: int | None
    q_values: Sequence[float]
    supervision: Supervision
    proposed: Action | None


def sentence(facts: Facts) -> str:
    """Return a decision and its reason in one line; faults have texts of their own."""
    parts = _supervisor(facts)
    if not (facts.why.no_action_is_sound or (parts and facts.reason is Reason.FIXED)):
        parts = [*_own_reason(facts), *parts]
    if facts.why.critical is not Critical.NOBODY:
        parts.append(f"{_who_comes(facts)}{_outlook(facts)}")
    elif not parts:
        parts = ["no conflict within range"]
    agreed = facts.supervision is Supervision.AGREED and not facts.why.no_action_is_sound
    if agreed and facts.reason is Reason.LEARNED:
        parts.append("supervisor agrees")
    return f"{facts.action.name}: {'; '.join(parts)}"


def _own_reason(facts: Facts) -> list[str]:
    """Say why the policy wants it, where that is not somebody else on the road."""
    if facts.reason is Reason.GOAL_REACHED:
        return ["the goal is reached"]
    if facts.reason is Reason.FIXED:
        return ["the policy always decides so"]
    if facts.reason is not Reason.LEARNED:
        return []
    others = [each for each in Action if each is not facts.action]
    second = max(others, key=lambda each: facts.q_values[each])
    lead = facts.q_values[facts.action] - facts.q_values[second]
    return [f"rated {lead:.2g} above {second.name}"]


def _supervisor(facts: Facts) -> list[str]:
    if facts.why.no_action_is_sound:
        return ["carrying on the last safe plan"]
    if facts.supervision in _CHECKS and facts.proposed is not None:
        return [_CHECKS[facts.supervision].format(facts.proposed.name)]
    return []


def _who_comes(facts: Facts) -> str:
    """Say who matters most, and when that one comes."""
    why, lane = facts.why, f"lane {facts.lane_id}"
    zone = f"{'merging' if why.merging else 'conflict'} zone of {lane}"
    if why.hidden:
        if why.critical is Critical.IN_ZONE:
            return f"a vehicle may hide in {zone}"
        comes = "merges" if why.merging else "arrives"
        return (
            f"{lane} is hidden beyond {why.distance_m:.1f} m, "
            f"a vehicle there {comes} in {why.reach_s:.1f} s"
        )
    who = f"vehicle {facts.vehicle_id}"
    if why.critical in _SAME_LANE:
        side = "ahead" if why.critical is Critical.AHEAD else "behind"
        return (
            f"{who} from {lane} drives {abs(why.ahead_m):.1f} m {side} at {why.speed_mps:.1f} m/s"
        )
    if why.critical is Critical.IN_ZONE:
        return f"{who} is in {zone}"
    return f"{who} reaches {zone} in {why.reach_s:.1f} s"


def _outlook(facts: Facts) -> str:
    """Say what follows for the ego, from the considered action where that is another one."""
    why = facts.why
    other = _other_action(facts)
    if why.critical in _SAME_LANE:
        return _in_same_lane(why, other)
    after = f" with {other}" if other else ""
    if why.verdict is Verdict.STOPS_IN_TIME:
        return f", can still stop{after}"
    leaving = f", leaving takes {why.leave_s:.1f} s{after}"
    if why.verdict is Verdict.KEEPS_BACK:
        return f"{leaving}; keeps back for a run-up"
    told = why.verdict is Verdict.LEAVES_IN_TIME or facts.reason is Reason.LEARNED
    if told or why.no_action_is_sound:
        return leaving
    gap = f" (gap wanted {why.gap_wanted_s:.1f} s)" if math.isfinite(why.gap_wanted_s) else ""
    return f"{leaving}{gap or _room(why)}"


def _other_action(facts: Facts) -> str:
    """Name the considered action unless it is taken, or named as what the supervisor forbids."""
    considered = facts.why.considered
    named = facts.supervision in _CHECKS and not facts.why.no_action_is_sound
    return "" if considered is None or considered is facts.action or named else considered.name


def _in_same_lane(why: Explanation, other: str) -> str:
    if why.verdict is Verdict.KEEPS_BACK:
        return "; keeps back"
    if why.verdict in {Verdict.TOO_CLOSE, Verdict.NO_WAY_OUT}:
        return f", too close{f' for {other}' if other else ''}{_room(why)}"
    return ""


def _room(why: Explanation) -> str:
    """Say what room lacks, where the check could tell."""
    return f", {why.lacking_s:.1f} s of room lacking" if math.isfinite(why.lacking_s) else ""
