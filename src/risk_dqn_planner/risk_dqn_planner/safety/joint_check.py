# SPDX-License-Identifier: Apache-2.0
"""Which actions are sound: one manoeuvre after them is safe against everyone at once.

The paper asks for each vehicle apart whether the ego can stop before it *or* leave before it.
With adjacent lanes both may hold for different vehicles while no motion does both. Here an action
is admissible if the ego, having followed it for one decision period, has *one* manoeuvre left
(brake to rest, or go; or go for a while and then rest) that is safe against the real and virtual
vehicles of all lanes. What it does during the action itself counts as well.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.safety.assumptions import SafetyAssumptions, SafetyNumbers
from risk_dqn_planner.safety.course import (
    BRAKE,
    GO,
    Course,
    begin_between,
    time_at,
    with_manoeuvre,
)
from risk_dqn_planner.safety.known import Known, at_first_sight
from risk_dqn_planner.safety.merging import merging_margin
from risk_dqn_planner.safety.others import NOTHING, earliest_arrivals
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations

ACTIONS = 3
NO_MANOEUVRE = -1
# Of the action in force: any may be.
UNKNOWN = -1
# Going for longer than this before coming to rest is not looked at.
_MOST_PERIODS = 16
# A manoeuvre that is safe by nothing must not fail by rounding when it is looked at again [s, m].
_ROUNDING = 1e-6


class JointCheck(NamedTuple):
    """What the check says of B situations and the three actions, columns as in Action, (B, 3).

    admissible; periods: the manoeuvre that vindicates the action, as the number of decision
    periods of going before the ego brakes to rest: 0 is BRAKE, GO for ever; -1 none.
    margin_s: time left of the vindicating manoeuvre, or (negative) missing in GO; room counts as
    the time that the ego takes for it at fast speed; infinity where nobody matters.
    critical_vehicle: index of who has that margin, -1 a hidden vehicle or nobody; critical_lane:
    index of its lane, -1 nobody.
    """

    admissible: Booleans
    periods: Integers
    margin_s: Floats
    critical_vehicle: Integers
    critical_lane: Integers


class Verdict(NamedTuple):
    """The margin of one course, and whose it is.

    bound_m: no other manoeuvre after the same action, but one that rests within this, is safe;
    known of GO alone, which leaves every zone first.
    """

    margin_s: float
    vehicle: int
    lane: int
    bound_m: float


def joint_check(
    situations: Situations,
    assumptions: SafetyAssumptions,
    in_force: NDArray[np.int64] | None = None,
    known: Known | None = None,
) -> JointCheck:
    """Return for each situation which actions are admissible, and why.

    in_force (B,): the action before, carried on during the actuation delay, or UNKNOWN; Stop by
    default.
    known: what was learnt before; by default this is the first look.
    """
    batch, p = len(situations.lane_mask), assumptions.numbers()
    shape = (batch, ACTIONS)
    result = JointCheck(
        np.zeros(shape, dtype=np.bool_),
        np.full(shape, NO_MANOEUVRE),
        np.full(shape, np.inf),
        np.full(shape, NOTHING),
        np.full(shape, NOTHING),
    )
    check_into(
        situations,
        p,
        np.zeros(batch, dtype=np.int64) if in_force is None else in_force,
        at_first_sight(situations, p) if known is None else known,
        result,
    )
    return result


@allocating_kernel
def check_into(
    s: Situations,
    p: SafetyNumbers,
    in_force: Integers,
    known: Known,
    result: JointCheck,
) -> None:
    """Fill `result` row by row."""
    lanes = s.lane_mask.shape[1]
    arrival_s, who = np.empty(lanes), np.empty(lanes, dtype=np.int64)
    for row in range(s.ego_speed_mps.shape[0]):
        last_m, merging = foresee(s, row, known, p, arrival_s, who)
        for action in range(ACTIONS):
            least_mps, most_mps = targets_in_force(in_force[row], p)
            course = begin_between(
                max(s.ego_speed_mps[row], 0.0), least_mps, most_mps, target_of(action, p), p
            )
            periods, verdict = vindicate(s, row, course, arrival_s, who, known, last_m, merging, p)
            result.admissible[row, action] = periods != NO_MANOEUVRE
            result.periods[row, action] = periods
            result.margin_s[row, action] = verdict.margin_s
            result.critical_vehicle[row, action] = verdict.vehicle
            result.critical_lane[row, action] = verdict.lane


@kernel
def targets_in_force(in_force: int, p: SafetyNumbers) -> tuple[float, float]:
    """Return between which targets the one in force lies."""
    if in_force == UNKNOWN:
        return 0.0, p.fast_mps
    target_mps = target_of(in_force, p)
    return target_mps, target_mps


@kernel
def target_of(action: int, p: SafetyNumbers) -> float:
    """Return the speed that an action heads for."""
    if action == 0:
        return 0.0
    return p.slow_mps if action == 1 else p.fast_mps


@kernel
def foresee(
    s: Situations, row: int, known: Known, p: SafetyNumbers, arrival_s: Floats, who: Integers
) -> tuple[float, bool]:
    """Fill when anyone may be in each crossing zone (M,), and who.

    Returns the way to the end of the last zone, and whether a merging lane matters.
    """
    last_m, merging = 0.0, False
    for lane in range(s.lane_mask.shape[1]):
        if not s.lane_mask[row, lane]:
            continue
        end_m = s.lane_ego_distance_m[row, lane] + 0.5 * s.lane_ego_zone_m[row, lane]
        last_m = max(last_m, end_m + p.zone_margin_m)
        merging |= s.lane_merging[row, lane]
    earliest_arrivals(s, row, known, p, arrival_s, who)
    return last_m, merging


@kernel
def is_enough(margin_s: float) -> bool:
    """Tell whether a margin makes a manoeuvre sound."""
    return margin_s >= -_ROUNDING


@kernel
def vindicate(
    s: Situations,
    row: int,
    course: Course,
    arrival_s: Floats,
    who: Integers,
    known: Known,
    last_m: float,
    merging: bool,
    p: SafetyNumbers,
) -> tuple[int, Verdict]:
    """Return the manoeuvre that makes a course safe, -1 for none, and the verdict on it.

    arrival_s, who (M,): when somebody reaches each crossing lane's zone at the earliest [s], and
    the vehicle's index. last_m: way to the end of the last zone [m]. merging: whether a merging
    lane matters. Without a manoeuvre, the verdict is that of going.
    """
    braking = with_manoeuvre(course, BRAKE, p)
    verdict = judge(s, row, braking, arrival_s, who, known, p)
    if is_enough(verdict.margin_s):
        return BRAKE, verdict
    return go_on(s, row, course, arrival_s, who, known, -math.inf, last_m, merging, p)


@kernel
def go_on(
    s: Situations,
    row: int,
    course: Course,
    arrival_s: Floats,
    who: Integers,
    known: Known,
    beyond_m: float,
    last_m: float,
    merging: bool,
    p: SafetyNumbers,
) -> tuple[int, Verdict]:
    """Return how a course may go on safely, for ever or to a rest beyond a way; -1 for not at all.

    beyond_m: a rest counts only after this way [m]; the other arguments as in `vindicate`. The
    second is the verdict on it; without one, that of going for ever.
    """
    going = judge(s, row, course, arrival_s, who, known, p)
    if is_enough(going.margin_s):
        return GO, going
    # Behind all zones a rest is of use only where going on for ever fails, behind a leader.
    bound_m = going.bound_m if merging else min(going.bound_m, last_m)
    for periods in range(1, _MOST_PERIODS + 1):
        stopping = with_manoeuvre(course, periods, p)
        if stopping.fastest.rest_m > bound_m + _ROUNDING:
            break
        if stopping.slowest.rest_m > beyond_m + _ROUNDING:
            verdict = judge(s, row, stopping, arrival_s, who, known, p)
            if is_enough(verdict.margin_s):
                return periods, verdict
        if stopping.slowest.rest_m > last_m:
            break
    return NO_MANOEUVRE, going


@kernel
def judge(
    s: Situations,
    row: int,
    c: Course,
    arrival_s: Floats,
    who: Integers,
    known: Known,
    p: SafetyNumbers,
) -> Verdict:
    """Return the least margin [s] of a course over all lanes, arguments as in `vindicate`."""
    least_s, whose, where, bound_m = math.inf, NOTHING, NOTHING, math.inf
    for lane in range(s.lane_mask.shape[1]):
        if not s.lane_mask[row, lane]:
            continue
        if s.lane_merging[row, lane]:
            margin_s, vehicle, within_m = merging_verdict(s, row, lane, c, known, p)
        else:
            vehicle = who[lane]
            margin_s, within_m = crossing_verdict(s, row, lane, c, arrival_s[lane], p)
        if not is_enough(margin_s):
            bound_m = min(bound_m, within_m)
        if margin_s < least_s:
            least_s, whose, where = margin_s, vehicle, lane
        if not is_enough(least_s) and c.fastest.rest_m < math.inf:
            # Nobody asks by how much a course that comes to rest fails.
            break
    return Verdict(least_s, whose, where, bound_m)


@kernel
def crossing_verdict(
    s: Situations, row: int, lane: int, c: Course, arrival_s: float, p: SafetyNumbers
) -> tuple[float, float]:
    """Return the time left at a crossing zone, and within what way a rest would be before it."""
    half_m = 0.5 * s.lane_ego_zone_m[row, lane]
    end_m = s.lane_ego_distance_m[row, lane] + half_m
    before_m = s.lane_ego_distance_m[row, lane] - half_m - p.zone_margin_m
    if c.fastest.rest_m <= before_m + _ROUNDING or end_m <= 0.0 or arrival_s == math.inf:
        return math.inf, before_m
    # At rest in the zone, or not far enough from it, is no place to be.
    if c.slowest.rest_m < end_m + p.zone_margin_m:
        return -math.inf, before_m
    return arrival_s - time_at(c.slowest, end_m) - p.safe_gap_s, before_m


@kernel
def merging_verdict(
    s: Situations, row: int, lane: int, c: Course, known: Known, p: SafetyNumbers
) -> tuple[float, int, float]:
    """Return the room left at a merging lane as time, whose it is, and within what way to rest."""
    start_m = s.lane_ego_distance_m[row, lane] - 0.5 * s.lane_ego_zone_m[row, lane]
    before_m = start_m - p.zone_margin_m
    if c.fastest.rest_m <= before_m + _ROUNDING:
        return math.inf, NOTHING, before_m
    if c.slowest.rest_m <= start_m:
        return -math.inf, NOTHING, before_m
    room_m, vehicle, within_m = merging_margin(s, row, lane, known, c, p, start_m)
    return room_m / p.fast_mps, vehicle, within_m
