# SPDX-License-Identifier: Apache-2.0
"""How much time there would be if the ego waited for a while and then went (kernels).

In traffic that keeps its speed, for each of the coming decisions, and for five ways to wait: by
Stop, by Slow, by going as far as the ego can still rest before the next zone, and by that after one
period of Stop or of Slow. Nothing is searched and nothing is chosen: the plans are always the same
ones, and their margins are numbers for a network.
"""

import math
from typing import NamedTuple

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.policies.foresight.prediction import look_from, predict
from risk_dqn_planner.policies.foresight.task import Task, Work
from risk_dqn_planner.policies.foresight.waiting import decimetres_matter, find_places, free_way
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.safety.assumptions import SafetyNumbers
from risk_dqn_planner.safety.course import begin_course
from risk_dqn_planner.safety.joint_check import ACTIONS, go_on, target_of
from risk_dqn_planner.situation.situations import Floats

_ROUNDING = 1e-6
# By Stop, by Slow, by coming nearer, and by that after a period of Stop or Slow.
WAYS_TO_WAIT = 5
_COME_NEARER, _AFTER_ONE = 2, 3


class Place(NamedTuple):
    """Where the ego will wait next, if it has to: ways [m] from now on, infinity if nowhere.

    free_m: the way up to the next zone. rest_m: to the place. clear_m: to the end of the zones
    behind it, up to another place. joins: it waits to join a lane. creeping: it will not see
    enough before it stands there, so that decimetres matter.
    """

    free_m: float
    rest_m: float
    clear_m: float
    joins: bool
    creeping: bool


@kernel
def next_place(t: Task, w: Work) -> Place:
    """Return the nearest place before which the ego can still come to rest."""
    mps = max(t.s.ego_speed_mps[t.row], 0.0)
    stops_m = 0.5 * mps * mps / t.p.ego_down_mps2
    free_m, count = free_way(t), find_places(t, w.places)
    rest_m, clear_m, joins = math.inf, math.inf, False
    for j in range(count):
        if stops_m - _ROUNDING <= w.places.rest_m[j] < rest_m:
            rest_m, clear_m = w.places.rest_m[j], w.places.clear_m[j]
            joins = w.places.joins[j]
    return Place(free_m, rest_m, clear_m, joins, decimetres_matter(t, w.places, count))


@kernel
def forecast(t: Task, place: Place, periods: int, w: Work, ego: Floats, margin_s: Floats) -> None:
    """Fill the margins (5, K) of going after k + 1 periods of each way to wait.

    A margin is the one of the joint check [s], in the situation predicted for then, of going
    through everything or to a rest beyond the place. ego (5, 3): room for where each way to wait
    has led, how fast, and the speed it headed for.
    """
    p = t.p
    for wait in range(WAYS_TO_WAIT):
        ego[wait, 0], ego[wait, 1] = 0.0, max(t.s.ego_speed_mps[t.row], 0.0)
    limit_m = place.free_m if place.rest_m == math.inf else place.rest_m
    for k in range(1, periods + 1):
        last_m, merging = predict(t, k, w)
        for wait in range(WAYS_TO_WAIT):
            before_m, before_mps = ego[wait, 0], ego[wait, 1]
            target_mps = waiting_speed(wait, k, before_m, before_mps, limit_m, p)
            way_m = before_m + travelled(before_mps, target_mps, p.period_s, p)
            mps = reached(before_mps, target_mps, p.period_s, p)
            ego[wait, 0], ego[wait, 1], ego[wait, 2] = way_m, mps, target_mps
            first = first_like(ego, wait)
            if first == wait:
                look_from(t, k, way_m, w)
                course = begin_course(mps, target_mps, p.fast_mps, p)
                _, verdict = go_on(
                    w.ahead,
                    k,
                    course,
                    w.arrival_s,
                    w.who,
                    w.known,
                    place.rest_m - way_m,
                    last_m - way_m,
                    merging,
                    p,
                )
                margin_s[wait, k - 1] = verdict.margin_s
            else:
                margin_s[wait, k - 1] = margin_s[first, k - 1]


@kernel
def first_like(ego: Floats, wait: int) -> int:
    """Return the first way to wait that has led to the same as this one, or this one."""
    for other in range(wait):
        if (
            ego[other, 0] == ego[wait, 0]
            and ego[other, 1] == ego[wait, 1]
            and ego[other, 2] == ego[wait, 2]
        ):
            return other
    return wait


@kernel
def waiting_speed(
    wait: int, period: int, way_m: float, mps: float, limit_m: float, p: SafetyNumbers
) -> float:
    """Return the speed that a way to wait heads for in a period, the first of which is 1."""
    if wait < _COME_NEARER:
        return target_of(wait, p)
    if wait >= _AFTER_ONE and period == 1:
        return target_of(wait - _AFTER_ONE, p)
    return nearing_speed(way_m, mps, limit_m, p)


@kernel
def nearing_speed(way_m: float, mps: float, limit_m: float, p: SafetyNumbers) -> float:
    """Return the speed of the fastest action after which the ego can rest before a limit."""
    for slower in range(ACTIONS - 1):
        target_mps = target_of(ACTIONS - 1 - slower, p)
        if rests_at(way_m, mps, target_mps, p) <= limit_m:
            return target_mps
    return 0.0


@kernel
def rests_at(way_m: float, mps: float, target_mps: float, p: SafetyNumbers) -> float:
    """Return where an ego can rest that heads for a speed for a period, and brakes then."""
    then_mps = reached(mps, target_mps, p.period_s, p)
    stops_m = way_m + travelled(mps, target_mps, p.period_s, p)
    return stops_m + 0.5 * then_mps * then_mps / p.ego_down_mps2


@kernel
def travelled(mps: float, target_mps: float, time_s: float, p: SafetyNumbers) -> float:
    """Return the way of an ego that heads for a speed."""
    way_m: float = distance_after(time_s, mps, target_mps, p.ego_up_mps2, p.ego_down_mps2)
    return way_m


@kernel
def reached(mps: float, target_mps: float, time_s: float, p: SafetyNumbers) -> float:
    """Return the speed of an ego that heads for one."""
    then_mps: float = speed_after(time_s, mps, target_mps, p.ego_up_mps2, p.ego_down_mps2)
    return then_mps
