# SPDX-License-Identifier: Apache-2.0
"""The ego's motion under an action and one manoeuvre after it, exact and in pieces (kernels).

The decision before stays in force for the delay, the action holds for one decision period, then
the ego heads for its fast speed for a whole number of periods, and brakes to rest. Those last
two are the manoeuvre: no period of going is BRAKE, endlessly many are GO. Whole periods, so that
following a manoeuvre for one decision leaves a manoeuvre.

Where delay, acceleration or braking are known to lie in ranges only, or the decision before is not
known, a course has two motions, and the ego is never ahead of the one nor behind the other: speeds
that begin in order, and head for targets in order, at rates in order, stay in order.
"""

import math
from typing import NamedTuple

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.risk.motion import distance_after, speed_after, time_to_travel
from risk_dqn_planner.safety.assumptions import SafetyNumbers

# Periods of going before the ego brakes.
BRAKE = 0
GO = 1_000_000


class Motion(NamedTuple):
    """Four pieces; piece k begins at time t [s], way m [m] and speed v [m/s] numbered k.

    Piece 0 heads for target0_mps, piece 1 for target1_mps, piece 2 for fast_mps, piece 3 for
    rest, which is reached after `rest_m`; infinity, as the beginning of piece 3, if never.
    slowing_until_s: from then on the ego slows down no more, but for piece 3. braking_s: when
    piece 3 begins if there is no piece 2. up_mps2, down_mps2: how fast speeds change.
    """

    v0: float
    target0_mps: float
    t1: float
    m1: float
    v1: float
    target1_mps: float
    t2: float
    m2: float
    v2: float
    t3: float
    m3: float
    v3: float
    rest_m: float
    slowing_until_s: float
    braking_s: float
    fast_mps: float
    up_mps2: float
    down_mps2: float


class Course(NamedTuple):
    """The motions between which the ego's lies at any time; exact: they are the same."""

    fastest: Motion
    slowest: Motion
    exact: bool


@kernel
def begin_course(v0: float, in_force_mps: float, target_mps: float, p: SafetyNumbers) -> Course:
    """Return the course of an action that heads for `target_mps`, with GO after it."""
    return begin_between(v0, in_force_mps, in_force_mps, target_mps, p)


@kernel
def begin_between(
    v0: float, least_mps: float, most_mps: float, target_mps: float, p: SafetyNumbers
) -> Course:
    """Return the course of an action if the target in force before it lies in a range.

    Whatever makes the ego faster takes effect as early as may be in the fastest motion, and as
    late as may be in the slowest.
    """
    early_s, late_s = p.delay_least_s, p.delay_s
    fastest = begin_motion(
        v0, most_mps, target_mps, early_s if target_mps > most_mps else late_s,
        early_s, late_s, p.ego_up_most_mps2, p.ego_down_mps2, p,
    )  # fmt: skip
    exact = (
        early_s == late_s
        and least_mps == most_mps
        and p.ego_up_most_mps2 == p.ego_up_mps2
        and p.ego_down_most_mps2 == p.ego_down_mps2
    )
    if exact:
        return Course(fastest, fastest, exact)
    slowest = begin_motion(
        v0, least_mps, target_mps, late_s if target_mps > least_mps else early_s,
        late_s, early_s, p.ego_up_mps2, p.ego_down_most_mps2, p,
    )  # fmt: skip
    return Course(fastest, slowest, exact)


@kernel
def begin_motion(
    v0: float,
    in_force_mps: float,
    target_mps: float,
    first_s: float,
    going_s: float,
    braking_s: float,
    up: float,
    down: float,
    p: SafetyNumbers,
) -> Motion:
    """Return the motion of an action, with GO after it.

    first_s, going_s, braking_s: delays of the action, of going after it, and of braking.
    """
    m1 = distance_after(first_s, v0, in_force_mps, up, down)
    v1 = speed_after(first_s, v0, in_force_mps, up, down)
    t2 = going_s + p.period_s
    m2 = m1 + distance_after(t2 - first_s, v1, target_mps, up, down)
    v2 = speed_after(t2 - first_s, v1, target_mps, up, down)
    slowing_until_s = 0.0
    if v1 < v0:
        slowing_until_s = first_s
    if v2 < v1:
        slowing_until_s = first_s + (v1 - v2) / down
    if v2 > p.fast_mps:
        slowing_until_s = t2 + (v2 - p.fast_mps) / down
    return Motion(
        v0, in_force_mps, first_s, m1, v1, target_mps, t2, m2, v2,
        math.inf, math.inf, p.fast_mps, math.inf, slowing_until_s,
        braking_s + p.period_s, p.fast_mps, up, down,
    )  # fmt: skip


@kernel
def with_manoeuvre(c: Course, periods: int, p: SafetyNumbers) -> Course:
    """Return a course with another manoeuvre: `periods` of going, then to rest."""
    fastest = ending(c.fastest, periods, p)
    if c.exact:
        return Course(fastest, fastest, c.exact)
    return Course(fastest, ending(c.slowest, periods, p), c.exact)


@kernel
def ending(c: Motion, periods: int, p: SafetyNumbers) -> Motion:
    """Return a motion with another manoeuvre."""
    up, down = c.up_mps2, c.down_mps2
    t2, m2, v2 = c.t2, c.m2, c.v2
    t3, m3, v3, rest_m = math.inf, math.inf, c.fast_mps, math.inf
    if periods == BRAKE and c.braking_s != t2:
        t2, action_s = c.braking_s, c.braking_s - c.t1
        m2 = c.m1 + distance_after(action_s, c.v1, c.target1_mps, up, down)
        v2 = speed_after(action_s, c.v1, c.target1_mps, up, down)
    if periods < GO:
        time_s = periods * p.period_s + (c.braking_s - t2)
        t3 = t2 + time_s
        m3 = m2 + distance_after(time_s, v2, c.fast_mps, up, down)
        v3 = speed_after(time_s, v2, c.fast_mps, up, down)
        rest_m = m3 + 0.5 * v3 * v3 / down
    return Motion(
        c.v0, c.target0_mps, c.t1, c.m1, c.v1, c.target1_mps, t2, m2, v2,
        t3, m3, v3, rest_m, c.slowing_until_s, c.braking_s, c.fast_mps, up, down,
    )  # fmt: skip


@kernel
def time_at(c: Motion, way_m: float) -> float:
    """Return when the ego has covered a way: 0 if it is behind already, infinity if never."""
    up, down = c.up_mps2, c.down_mps2
    if way_m <= 0.0:
        return 0.0
    if way_m > c.rest_m:
        return math.inf
    if way_m <= c.m1:
        time_s: float = time_to_travel(way_m, c.v0, c.target0_mps, up, down)
        return time_s
    if way_m <= c.m2:
        return c.t1 + float(time_to_travel(way_m - c.m1, c.v1, c.target1_mps, up, down))
    if way_m <= c.m3:
        return c.t2 + float(time_to_travel(way_m - c.m2, c.v2, c.fast_mps, up, down))
    return c.t3 + float(time_to_travel(way_m - c.m3, c.v3, 0.0, up, down))


@kernel
def way_at(c: Motion, time_s: float) -> float:
    """Return the way covered until a time."""
    up, down = c.up_mps2, c.down_mps2
    if time_s <= c.t1:
        way_m: float = distance_after(time_s, c.v0, c.target0_mps, up, down)
        return way_m
    if time_s <= c.t2:
        return c.m1 + float(distance_after(time_s - c.t1, c.v1, c.target1_mps, up, down))
    if time_s <= c.t3:
        return c.m2 + float(distance_after(time_s - c.t2, c.v2, c.fast_mps, up, down))
    return c.m3 + float(distance_after(time_s - c.t3, c.v3, 0.0, up, down))


@kernel
def speed_at(c: Motion, time_s: float) -> float:
    """Return the speed at a time."""
    up, down = c.up_mps2, c.down_mps2
    if time_s <= c.t1:
        speed_mps: float = speed_after(time_s, c.v0, c.target0_mps, up, down)
        return speed_mps
    if time_s <= c.t2:
        return float(speed_after(time_s - c.t1, c.v1, c.target1_mps, up, down))
    if time_s <= c.t3:
        return float(speed_after(time_s - c.t2, c.v2, c.fast_mps, up, down))
    return float(speed_after(time_s - c.t3, c.v3, 0.0, up, down))
