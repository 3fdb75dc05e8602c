# SPDX-License-Identifier: Apache-2.0
"""From a policy's answer to its explanation in numbers."""

import math
from typing import NamedTuple

from risk_dqn_planner.explanation.answer import NOBODY, Answer, Pair
from risk_dqn_planner.explanation.fields import Critical, Explanation, Verdict
from risk_dqn_planner.explanation.timing import (
    Yardstick,
    ahead_of_ego,
    arrival_time,
    distance_and_speed,
    has_joined,
    leave_time,
    nearest,
    of_check,
    of_prediction,
    tightest_leader,
)
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.course import GO
from risk_dqn_planner.situation.situations import Situations


class Weighed(NamedTuple):
    """An explanation, and whom it is about."""

    explanation: Explanation
    whom: Pair


def weigh(
    answer: Answer, s: Situations, config: RuleBasedConfig, assumptions: SafetyAssumptions
) -> Weighed:
    """Explain an answer to one situation, a batch of one.

    config, assumptions: what Algorithm 1 and the check of soundness reckon with.
    """
    known = Explanation(
        margins_s=_margins(answer),
        ego_speed_mps=float(s.ego_speed_mps[0]),
        stop_line_distance_m=float(s.stop_line_distance_m[0]),
    )
    if not answer.concerns_others:
        return Weighed(known, Pair(NOBODY, NOBODY))
    if answer.is_told_by_check:
        by = of_check(assumptions, answer.in_force)
    else:
        by = of_prediction(config, assumptions)
    whom = _whom(answer, s, by)
    if whom.lane < 0:
        return Weighed(known, whom)
    told = _about(whom, known, answer, s, by)
    if told.critical is Critical.AHEAD and answer.is_told_by_check and answer.lacking_s > 0.0:
        told, whom = _instead_of_leader(known, answer, s, by) or (told, whom)
    return Weighed(told._replace(verdict=_verdict(told, answer, by)), whom)


def _margins(answer: Answer) -> tuple[float, float, float]:
    """Return what the check leaves by action; what it admits lacks nothing, not even rounding."""
    if answer.checked is None:
        return math.nan, math.nan, math.nan
    stop, slow, fast = (
        max(each.margin_s, 0.0) if each.admissible else each.margin_s for each in answer.checked
    )
    return stop, slow, fast


def _whom(answer: Answer, s: Situations, by: Yardstick) -> Pair:
    """Return whom the policy names, else whom the check found nearest, else who comes first."""
    if answer.named.lane >= 0:
        return answer.named
    if answer.is_told_by_check and answer.checked is not None:
        nearest_by_check = answer.checked[answer.considered].whom
        if nearest_by_check.lane >= 0:
            return nearest_by_check
    return nearest(s, answer.considered, by)


def _about(
    whom: Pair, known: Explanation, answer: Answer, s: Situations, by: Yardstick
) -> Explanation:
    """Add what is told of the critical vehicle, all but the verdict."""
    lane = whom.lane
    distance_m, speed_mps = distance_and_speed(s, whom, by)
    merging = bool(s.lane_merging[0, lane])
    known = known._replace(
        considered=answer.considered,
        hidden=whom.vehicle < 0,
        merging=merging,
        distance_m=distance_m,
        speed_mps=speed_mps,
        ego_distance_m=float(s.lane_ego_distance_m[0, lane]),
        lacking_s=_room_lacking(whom, answer) if merging else math.nan,
    )
    if has_joined(s, whom):
        ahead_m = ahead_of_ego(s, whom)
        critical = Critical.AHEAD if ahead_m > 0.0 else Critical.BEHIND
        return known._replace(critical=critical, ahead_m=ahead_m)
    periods = GO
    if answer.is_told_by_check and answer.checked is not None:
        periods = answer.checked[answer.considered].periods
    reach_s = arrival_time(s, whom, by)
    leave_s = leave_time(s, lane, answer.considered, by, periods)
    critical = Critical.APPROACHING if reach_s > 0.0 else Critical.IN_ZONE
    known = known._replace(critical=critical, reach_s=reach_s, leave_s=leave_s)
    if merging and answer.is_told_by_check:
        return known
    gap_s = by.gap_wanted_s
    return known._replace(gap_wanted_s=gap_s, lacking_s=gap_s - (reach_s - leave_s))


def _instead_of_leader(
    known: Explanation, answer: Answer, s: Situations, by: Yardstick
) -> Weighed | None:
    """Tell of the leader that is tightest to stop behind, or of who comes first where all do.

    Going on for ever fails behind any leader, however far, so the check may name any of them.
    None where there is none.
    """
    leader = tightest_leader(s, answer.considered, by)
    if leader is None:
        return None
    if leader.lacking_s <= 0.0:
        first = nearest(s, answer.considered, by)
        if first.lane >= 0:
            told = _about(first, known, answer, s, by)
            if not told.lacking_s <= 0.0:
                return Weighed(told, first)
    told = _about(leader.whom, known, answer, s, by)
    lacking_s = leader.lacking_s if leader.lacking_s > 0.0 else math.nan
    return Weighed(told._replace(lacking_s=lacking_s), leader.whom)


def _room_lacking(whom: Pair, answer: Answer) -> float:
    """Return the room that lacks on a merging lane, as time; NaN where the check says nothing."""
    if not answer.is_told_by_check or answer.checked is None:
        return math.nan
    checked = answer.checked[answer.considered]
    return -checked.margin_s if checked.whom == whom else math.nan


def _verdict(told: Explanation, answer: Answer, by: Yardstick) -> Verdict:
    """Return what holds of the considered action."""
    leaves = told.lacking_s <= 0.0
    if answer.is_told_by_check and answer.checked is not None:
        if answer.lacking_s > 0.0:
            return Verdict.NO_WAY_OUT
        if answer.considered is not answer.action:
            return Verdict.KEEPS_BACK
        leaves |= math.isfinite(answer.checked[answer.considered].margin_s)
    elif answer.named.lane >= 0:
        return Verdict.TOO_CLOSE if told.critical is Critical.AHEAD else Verdict.TOO_LATE
    else:
        # Whoever comes after the ego has left during the action itself is no matter.
        leaves |= told.leave_s <= by.numbers.period_s
    return Verdict.LEAVES_IN_TIME if leaves else Verdict.STOPS_IN_TIME
