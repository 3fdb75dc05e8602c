# SPDX-License-Identifier: Apache-2.0
"""Search over sound actions in predicted traffic: what gets the ego to its goal first (kernels).

States are the ego's way and speed at each decision of the horizon; those in one cell of both are
one, so that there are never many. Each step must pass the joint check in the situation predicted
for it. Where going is sound a branch ends: nothing is faster.
"""

import math

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.policies.foresight.prediction import look_from, predict
from risk_dqn_planner.policies.foresight.task import (
    Best,
    Cells,
    Node,
    Nodes,
    SearchNumbers,
    Task,
    Work,
)
from risk_dqn_planner.policies.foresight.waiting import (
    decimetres_matter,
    find_places,
    free_way,
    nothing_to_decide,
    places_ahead,
    waiting_price,
)
from risk_dqn_planner.risk.motion import time_to_cover
from risk_dqn_planner.safety.assumptions import SafetyNumbers
from risk_dqn_planner.safety.course import begin_course, speed_at, time_at, way_at
from risk_dqn_planner.safety.joint_check import (
    ACTIONS,
    NO_MANOEUVRE,
    Verdict,
    is_enough,
    judge,
    target_of,
    vindicate,
)
from risk_dqn_planner.safety.known import Known
from risk_dqn_planner.safety.others import NOTHING
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations

_STOP, _SLOW, _FAST = 0, 1, 2


@kernel
def search_into(
    s: Situations,
    p: SafetyNumbers,
    c: SearchNumbers,
    known: Known,
    corner_m: Floats,
    sound: Booleans,
    in_force: Integers,
    w: Work,
    action: Integers,
    critical: Integers,
) -> None:
    """Fill the first action (B,) of the best plans, and who forbids to go at once (B, 2)."""
    for row in range(s.ego_speed_mps.shape[0]):
        search(Task(s, row, p, c, known, corner_m, sound, in_force), w)
        action[row] = w.best.action[0]
        critical[row, 0], critical[row, 1] = w.best.critical[0], w.best.critical[1]


@kernel
def search(t: Task, w: Work) -> None:
    """Find the best plan of one situation."""
    w.best.total_s[0], w.best.critical[:] = math.inf, NOTHING
    allowed = 0
    for action in range(ACTIONS):
        if t.sound[t.row, action]:
            w.best.action[0] = action
            allowed += 1
    free_m = free_way(t)
    places = find_places(t, w.places)
    if allowed == 1:
        return
    if w.best.action[0] == _FAST and nothing_to_decide(t, free_m, w.places, places, w.shortfall_m):
        return
    fine = t.c.fine if decimetres_matter(t, w.places, places) else 1
    w.cells.stamp[:] = NOTHING
    nodes = w.nodes
    nodes.way_m[0, 0], nodes.cost_s[0, 0] = 0.0, 0.0
    nodes.speed_mps[0, 0] = max(t.s.ego_speed_mps[t.row], 0.0)
    nodes.last[0, 0] = t.in_force[t.row]
    count = 1
    for k in range(t.c.decisions):
        last_m, merging = predict(t, k, w)
        count = follow(t, k, count, free_m, last_m, merging, fine, places, w)
    side = t.c.decisions % 2
    for i in range(count):
        way_m, mps = nodes.way_m[side, i], nodes.speed_mps[side, i]
        total_s = nodes.cost_s[side, i] + t.c.decisions * t.p.period_s
        total_s += rest_of_time(t.s.goal_distance_m[t.row] - way_m, mps, t.p)
        if total_s < w.best.total_s[0]:
            total_s += waiting_price(t, way_m, mps, w.places, places, w.shortfall_m)
            offer(total_s, nodes.first[side, i], w.best)


@kernel
def follow(
    t: Task,
    k: int,
    count: int,
    free_m: float,
    last_m: float,
    merging: bool,
    fine: int,
    places: int,
    w: Work,
) -> int:
    """Follow the states of decision k by each sound action; return how many states that makes.

    fine: by how much cells are finer than usual; places: how many there are to wait at.
    """
    p, side, more, goal_m = t.p, k % 2, 0, t.s.goal_distance_m[t.row]
    for i in range(count):
        way_m, mps = w.nodes.way_m[side, i], w.nodes.speed_mps[side, i]
        last, before_s = w.nodes.last[side, i], w.nodes.cost_s[side, i]
        least_s = k * p.period_s + rest_of_time(goal_m - way_m, mps, p)
        if before_s + least_s >= w.best.total_s[0]:
            continue
        look_from(t, k, way_m, w)
        # The faster action comes first, so that it is taken of two that are as good.
        for slower in range(ACTIONS):
            action = _FAST - slower
            if not t.sound[t.row, action] if k == 0 else is_same(action, last, mps, p):
                continue
            course = begin_course(mps, target_of(last, p), target_of(action, p), p)
            cost_s = before_s + (t.c.switching_s if action != last else 0.0)
            first = action if k == 0 else w.nodes.first[side, i]
            if action == _FAST:
                going = judge(w.ahead, k, course, w.arrival_s, w.who, w.known, p)
                if is_enough(going.margin_s):
                    offer(cost_s + least_s, first, w.best)
                    break
                note_critical(k, going, w.best)
            motion = course.slowest
            stops_m = motion.m2 + 0.5 * motion.v2 * motion.v2 / p.ego_down_mps2
            if k > 0 and stops_m > free_m - way_m:
                periods, _ = vindicate(
                    w.ahead, k, course, w.arrival_s, w.who, w.known, last_m - way_m, merging, p
                )
                if periods == NO_MANOEUVRE:
                    continue
            step_m = way_at(motion, p.period_s)
            if way_m + step_m >= goal_m:
                goal_s = k * p.period_s + time_at(motion, goal_m - way_m)
                offer(cost_s + goal_s, first, w.best)
            else:
                step_mps = speed_at(motion, p.period_s)
                waits = places_ahead(way_m + step_m, w.places, places)
                cost_s += waits * t.c.haste * p.period_s
                node = Node(way_m + step_m, step_mps, cost_s, first, action)
                more = put(node, k, more, t.c, fine, p, w.nodes, w.cells)
    return more


@kernel
def is_same(action: int, last: int, speed_mps: float, p: SafetyNumbers) -> bool:
    """Tell whether another action does the same for a period, and is less of a change.

    An ego that is fast enough brakes all the time by Slow as by Stop.
    """
    alike = p.delay_s == 0.0 and speed_mps >= p.slow_mps + p.ego_down_mps2 * p.period_s
    return alike and action == (_SLOW if last == _STOP else _STOP)


@kernel
def rest_of_time(way_m: float, speed_mps: float, p: SafetyNumbers) -> float:
    """Return how long a state takes to the goal at least."""
    time_s: float = time_to_cover(way_m, speed_mps, p.ego_up_mps2, p.fast_mps)
    return time_s


@kernel
def note_critical(k: int, going: Verdict, best: Best) -> None:
    """Take note of who forbids to go at present."""
    if k == 0:
        best.critical[0], best.critical[1] = going.vehicle, going.lane


@kernel
def offer(total_s: float, first: int, best: Best) -> None:
    """Take note of a plan's first action if it is better than those before."""
    if total_s < best.total_s[0]:
        best.total_s[0], best.action[0] = total_s, first


@kernel
def put(
    node: Node,
    k: int,
    count: int,
    c: SearchNumbers,
    fine: int,
    p: SafetyNumbers,
    nodes: Nodes,
    cells: Cells,
) -> int:
    """Add a state that follows decision k, or let it replace a dearer one in its cell.

    States that still carry out unlike actions go on unlike each other. Returns how many there are.
    """
    speeds = int(p.fast_mps / c.cell_mps) + 2
    column = min(int(node.speed_mps / c.cell_mps + 0.5), speeds - 1)
    cell = int(node.way_m * fine / c.cell_m) * speeds + column
    if p.delay_s > 0.0:
        cell = cell * ACTIONS + node.last
    cell = min(cell, len(cells.stamp) - 1)
    side, i = (k + 1) % 2, count
    if cells.stamp[cell] == k:
        i = cells.node[cell]
        if nodes.cost_s[side, i] <= node.cost_s:
            return count
    else:
        count += 1
    cells.stamp[cell], cells.node[cell] = k, i
    nodes.way_m[side, i], nodes.speed_mps[side, i] = node.way_m, node.speed_mps
    nodes.cost_s[side, i] = node.cost_s
    nodes.first[side, i], nodes.last[side, i] = node.first, node.last
    return count
