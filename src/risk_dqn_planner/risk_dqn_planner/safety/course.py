# SPDX-License-Identifier: Apache-2.0
"""The ego's motion under an action and one manoeuvre after it, exact and in pieces (kernels).

The decision before stays in force for the delay, the action holds for one decision period, then
the ego heads for its fast speed for a whole number of periods, and brakes to rest. Those last
two are the manoeuvre: no period of going is BRAKE, endlessly many are GO. Whole periods, so that
following a manoeuvre for one decision leaves a manoeuvre.
"""

import math
from typing import NamedTuple

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.risk.motion import distance_after, speed_after, time_to_travel
from risk_dqn_planner.safety.assumptions import SafetyNumbers

# Periods of going before the ego brakes.
BRAKE = 0
GO = 1_000_000


class Course(NamedTuple):
    """Four pieces; piece k begins at time t [s], way m [m] and speed v [m/s] numbered k.

    Piece 0 heads for target0_mps, piece 1 for target1_mps, piece 2 for fast speed, piece 3 for
    rest, which is reached after `rest_m`; infinity, as the beginning of piece 3, if never.
    slowing_until_s: from then on the ego slows down no more, but for piece 3.
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


@kernel
def begin_course(v0: float, in_force_mps: float, target_mps: float, p: SafetyNumbers) -> Course:
    """Return the course of an action that heads for `target_mps`, with GO after it."""
    up, down = p.ego_up_mps2, p.ego_down_mps2
    t1 = p.delay_s
    m1 = distance_after(t1, v0, in_force_mps, up, down)
    v1 = speed_after(t1, v0, in_force_mps, up, down)
    t2 = t1 + p.period_s
    m2 = m1 + distance_after(p.period_s, v1, target_mps, up, down)
    v2 = speed_after(p.period_s, v1, target_mps, up, down)
    slowing_until_s = 0.0
    if v1 < v0:
        slowing_until_s = t1
    if v2 < v1:
        slowing_until_s = t1 + (v1 - v2) / down
    return Course(
        v0, in_force_mps, t1, m1, v1, target_mps, t2, m2, v2,
        math.inf, math.inf, p.fast_mps, math.inf, slowing_until_s,
    )  # fmt: skip


@kernel
def with_manoeuvre(c: Course, periods: int, p: SafetyNumbers) -> Course:
    """Return a course with another manoeuvre: `periods` of going, then to rest."""
    t3, m3, v3, rest_m = math.inf, math.inf, p.fast_mps, math.inf
    if periods < GO:
        time_s = periods * p.period_s
        t3 = c.t2 + time_s
        m3 = c.m2 + distance_after(time_s, c.v2, p.fast_mps, p.ego_up_mps2, p.ego_down_mps2)
        v3 = speed_after(time_s, c.v2, p.fast_mps, p.ego_up_mps2, p.ego_down_mps2)
        rest_m = m3 + 0.5 * v3 * v3 / p.ego_down_mps2
    return Course(
        c.v0, c.target0_mps, c.t1, c.m1, c.v1, c.target1_mps, c.t2, c.m2, c.v2,
        t3, m3, v3, rest_m, c.slowing_until_s,
    )  # fmt: skip


@kernel
def time_at(c: Course, way_m: float, p: SafetyNumbers) -> float:
    """Return when the ego has covered a way: 0 if it is behind already, infinity if never."""
    up, down = p.ego_up_mps2, p.ego_down_mps2
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
        return c.t2 + float(time_to_travel(way_m - c.m2, c.v2, p.fast_mps, up, down))
    return c.t3 + float(time_to_travel(way_m - c.m3, c.v3, 0.0, up, down))


@kernel
def way_at(c: Course, time_s: float, p: SafetyNumbers) -> float:
    """Return the way covered until a time."""
    up, down = p.ego_up_mps2, p.ego_down_mps2
    if time_s <= c.t1:
        way_m: float = distance_after(time_s, c.v0, c.target0_mps, up, down)
        return way_m
    if time_s <= c.t2:
        return c.m1 + float(distance_after(time_s - c.t1, c.v1, c.target1_mps, up, down))
    if time_s <= c.t3:
        return c.m2 + float(distance_after(time_s - c.t2, c.v2, p.fast_mps, up, down))
    return c.m3 + float(distance_after(time_s - c.t3, c.v3, 0.0, up, down))


@kernel
def speed_at(c: Course, time_s: float, p: SafetyNumbers) -> float:
    """Return the speed at a time."""
    up, down = p.ego_up_mps2, p.ego_down_mps2
    if time_s <= c.t1:
        speed_mps: float = speed_after(time_s, c.v0, c.target0_mps, up, down)
        return speed_mps
    if time_s <= c.t2:
        return float(speed_after(time_s - c.t1, c.v1, c.target1_mps, up, down))
    if time_s <= c.t3:
        return float(speed_after(time_s - c.t2, c.v2, p.fast_mps, up, down))
    return float(speed_after(time_s - c.t3, c.v3, 0.0, up, down))
