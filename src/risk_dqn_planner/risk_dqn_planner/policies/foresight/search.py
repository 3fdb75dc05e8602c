# SPDX-License-Identifier: Apache-2.0
"""Search over sound actions in predicted traffic: what gets the ego to its goal first (kernels).

States are the ego's way and speed at each decision of the horizon; those in one cell of both are
one, so that there are never many. Each step must pass the joint check in the situation predicted
for it. Where going is sound a branch ends: nothing is faster.
"""

import math

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.policies.foresight.prediction import look_from, predict
from risk_dqn_planner.policies.foresight.task import SearchNumbers, Task, Work
from risk_dqn_planner.policies.foresight.waiting import (
    find_places,
    free_way,
    nothing_to_decide,
    waiting_price,
)
from risk_dqn_planner.risk.motion import time_to_cover
from risk_dqn_planner.safety.assumptions import SafetyNumbers
from risk_dqn_planner.safety.course import Course, begin_course, speed_at, time_at, way_at
from risk_dqn_planner.safety.joint_check import ACTIONS, NO_MANOEUVRE, judge, target_of, vindicate
from risk_dqn_planner.safety.others import NOTHING
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations

_ROUNDING = 1e-6
_STOP, _SLOW, _FAST = 0, 1, 2


@kernel
def search_into(
    s: Situations,
    p: SafetyNumbers,
    c: SearchNumbers,
    reacted_m: Floats,
    corner_m: Floats,
    sound: Booleans,
    in_force: Integers,
    w: Work,
    action: Integers,
    critical: Integers,
) -> None:
    """Fill the first action (B,) of the best plans, and who forbids to go at once (B, 2)."""
    for row in range(s.ego_speed_mps.shape[0]):
        search(Task(s, row, p, c, reacted_m, corner_m, sound, in_force), w)
        action[row] = w.action[0]
        critical[row] = w.critical


@kernel
def search(t: Task, w: Work) -> None:
    """Find the best plan of one situation."""
    w.total_s[0], w.critical[:] = math.inf, NOTHING
    allowed = 0
    for action in range(ACTIONS):
        if t.sound[t.row, action]:
            w.action[0] = action
            allowed += 1
    free_m = free_way(t)
    places = find_places(t, w.places)
    if allowed == 1:
        return
    if w.action[0] == _FAST and nothing_to_decide(t, free_m, w.places, places):
        return
    w.stamp[:] = NOTHING
    nodes = w.nodes
    nodes.way_m[0, 0], nodes.cost_s[0, 0] = 0.0, 0.0
    nodes.speed_mps[0, 0] = max(t.s.ego_speed_mps[t.row], 0.0)
    nodes.last[0, 0] = t.in_force[t.row]
    count = 1
    for k in range(t.c.decisions):
        last_m, merging = predict(t, k, w)
        more = 0
        for i in range(count):
            more = follow(t, k, i, more, free_m, last_m, merging, w)
        count = more
    side = t.c.decisions % 2
    for i in range(count):
        total_s = nodes.cost_s[side, i] + t.c.decisions * t.p.period_s
        total_s += rest_of_time(t, nodes.way_m[side, i], nodes.speed_mps[side, i])
        if total_s < w.total_s[0]:
            total_s += waiting_price(
                t, nodes.way_m[side, i], nodes.speed_mps[side, i], w.places, places
            )
            offer(total_s, nodes.first[side, i], w)


@kernel
def follow(
    t: Task, k: int, i: int, count: int, free_m: float, last_m: float, merging: bool, w: Work
) -> int:
    """Follow state i of decision k by each sound action; return how many follow it so far."""
    p, side = t.p, k % 2
    way_m, mps, last = w.nodes.way_m[side, i], w.nodes.speed_mps[side, i], w.nodes.last[side, i]
    before_s, least_s = w.nodes.cost_s[side, i], k * p.period_s + rest_of_time(t, way_m, mps)
    if before_s + least_s >= w.total_s[0]:
        return count
    look_from(t, k, way_m, w)
    # The faster action comes first, so that it is taken of two that are as good.
    for slower in range(ACTIONS):
        action = _FAST - slower
        if k == 0 and not t.sound[t.row, action]:
            continue
        if k > 0 and slow_and_stop_alike(mps, p) and action == (_SLOW if last == _STOP else _STOP):
            continue
        course = begin_course(mps, target_of(last, p), target_of(action, p), p)
        cost_s = before_s + (t.c.switching_s if action != last else 0.0)
        first = action if k == 0 else w.nodes.first[side, i]
        if action == _FAST and may_go(k, course, w, p):
            offer(cost_s + least_s, first, w)
            break
        if k > 0 and course.m2 + 0.5 * course.v2 * course.v2 / p.ego_down_mps2 > free_m - way_m:
            periods, _ = vindicate(
                w.ahead, k, course, w.arrival_s, w.who, w.reacted_m, last_m - way_m, merging, p
            )
            if periods == NO_MANOEUVRE:
                continue
        next_m = way_m + way_at(course, p.period_s, p)
        goal_m = t.s.goal_distance_m[t.row]
        if next_m >= goal_m:
            offer(cost_s + k * p.period_s + time_at(course, goal_m - way_m, p), first, w)
        else:
            next_mps = speed_at(course, p.period_s, p)
            count = put(t, k, count, next_m, next_mps, cost_s, first, action, w)
    return count


@kernel
def rest_of_time(t: Task, way_m: float, speed_mps: float) -> float:
    """Return how long a state takes to the goal at least."""
    way_m = t.s.goal_distance_m[t.row] - way_m
    time_s: float = time_to_cover(way_m, speed_mps, t.p.ego_up_mps2, t.p.fast_mps)
    return time_s


@kernel
def slow_and_stop_alike(speed_mps: float, p: SafetyNumbers) -> bool:
    """Tell whether the ego is so fast that it brakes for a whole period either way."""
    return p.delay_s == 0.0 and speed_mps >= p.slow_mps + p.ego_down_mps2 * p.period_s


@kernel
def may_go(k: int, course: Course, w: Work, p: SafetyNumbers) -> bool:
    """Tell whether going is sound from a state on; note at present who forbids it."""
    going = judge(w.ahead, k, course, w.arrival_s, w.who, w.reacted_m, p)
    sound = going.margin_s >= -_ROUNDING
    if k == 0 and not sound:
        w.critical[0], w.critical[1] = going.vehicle, going.lane
    return sound


@kernel
def offer(total_s: float, first: int, w: Work) -> None:
    """Take note of a plan's first action if it is better than those before."""
    if total_s < w.total_s[0]:
        w.total_s[0], w.action[0] = total_s, first


@kernel
def put(
    t: Task,
    k: int,
    count: int,
    way_m: float,
    speed_mps: float,
    cost_s: float,
    first: int,
    last: int,
    w: Work,
) -> int:
    """Add a state that follows decision k, or replace the dearer one in its cell."""
    speeds = int(t.p.fast_mps / t.c.cell_mps) + 2
    column = min(int(speed_mps / t.c.cell_mps + 0.5), speeds - 1)
    cell = min(int(way_m / t.c.cell_m) * speeds + column, len(w.stamp) - 1)
    side, i = (k + 1) % 2, count
    if w.stamp[cell] == k:
        i = w.node[cell]
        if w.nodes.cost_s[side, i] <= cost_s:
            return count
    else:
        count += 1
    w.stamp[cell], w.node[cell] = k, i
    w.nodes.way_m[side, i], w.nodes.speed_mps[side, i] = way_m, speed_mps
    w.nodes.cost_s[side, i] = cost_s
    w.nodes.first[side, i], w.nodes.last[side, i] = first, last
    return count
