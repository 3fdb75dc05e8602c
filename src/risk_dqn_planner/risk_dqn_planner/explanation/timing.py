# SPDX-License-Identifier: Apache-2.0
"""When others come and when the ego is gone, as whoever decided reckons it.

Situations are batches of one here.
"""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel
from risk_dqn_planner.explanation.answer import NOBODY, Pair
from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.risk.rewards import reach_time
from risk_dqn_planner.safety.assumptions import NO_CAP_MPS, SafetyAssumptions, SafetyNumbers
from risk_dqn_planner.safety.course import BRAKE, GO, begin_course, time_at, with_manoeuvre
from risk_dqn_planner.safety.joint_check import NO_MANOEUVRE, target_of
from risk_dqn_planner.safety.merging import leader_margin
from risk_dqn_planner.safety.others import hidden_arrival, hidden_speed, vehicle_arrival
from risk_dqn_planner.situation.common_path import leader_gap
from risk_dqn_planner.situation.situations import Floats, Situations


class Yardstick(NamedTuple):
    """How times are reckoned: limits of all motion, the gap wanted, and the action before.

    `numbers.period_s` is how long the considered action is carried out before the ego goes.
    """

    numbers: SafetyNumbers
    gap_wanted_s: float
    in_force: Action


def of_prediction(config: RuleBasedConfig, assumptions: SafetyAssumptions) -> Yardstick:
    """Return how Algorithm 1 reckons: the action for its whole horizon, everything known exactly.

    Its vehicles are those of the configuration.
    """
    ego, traffic = config.risk.ego, config.risk.traffic
    numbers = assumptions.numbers()._replace(
        period_s=config.horizon_s,
        delay_s=0.0,
        delay_least_s=0.0,
        ego_up_mps2=ego.acceleration_mps2,
        ego_up_most_mps2=ego.acceleration_mps2,
        ego_down_mps2=ego.braking_mps2,
        ego_down_most_mps2=ego.braking_mps2,
        fast_mps=ego.fast_mps,
        slow_mps=ego.slow_mps,
        others_up_mps2=traffic.acceleration_mps2,
        limit_factor=1.0,
        hidden_top_mps=NO_CAP_MPS,
        speed_error_mps=0.0,
        position_error_m=0.0,
    )
    return Yardstick(numbers, config.risk.desired_gap_s, Action.STOP)


def of_check(assumptions: SafetyAssumptions, in_force: Action) -> Yardstick:
    """Return how the check of soundness reckons: the action for one decision period."""
    return Yardstick(assumptions.numbers(), assumptions.safe_gap_s, in_force)


def leave_time(s: Situations, lane: int, action: Action, by: Yardstick, periods: int = GO) -> float:
    """Return when the ego has left a lane's zone, carrying out an action and a manoeuvre [s].

    Where the manoeuvre ends before that, the ego goes on instead.
    """
    return float(leave_times(s, int(action), int(by.in_force), periods, by.numbers)[lane])


@allocating_kernel
def leave_times(
    s: Situations, action: int, in_force: int, periods: int, p: SafetyNumbers
) -> Floats:
    """Return `leave_time` of each lane (M,); all of them at once, since each call costs time."""
    now_mps = max(s.ego_speed_mps[0], 0.0)
    going = begin_course(now_mps, target_of(in_force, p), target_of(action, p), p)
    course = with_manoeuvre(going, GO if periods == NO_MANOEUVRE else periods, p)
    leave_s = np.empty(s.lane_mask.shape[1])
    for lane in range(len(leave_s)):
        end_m = s.lane_ego_distance_m[0, lane] + 0.5 * s.lane_ego_zone_m[0, lane]
        leave_s[lane] = time_at(course.slowest, end_m)
        if not math.isfinite(leave_s[lane]):
            leave_s[lane] = time_at(going.slowest, end_m)
    return leave_s


def arrival_time(s: Situations, whom: Pair, by: Yardstick) -> float:
    """Return when a vehicle reaches its zone at the earliest, infinity once it has left [s]."""
    vehicle, lane = whom
    if vehicle < 0:
        return float(hidden_arrival(s, 0, lane, by.numbers))
    return float(
        vehicle_arrival(
            float(s.vehicle_distance_m[0, vehicle]),
            float(s.lane_zone_m[0, lane]),
            max(float(s.vehicle_speed_mps[0, vehicle]) + by.numbers.speed_error_mps, 0.0),
            float(s.lane_speed_limit_mps[0, lane]),
            by.numbers,
        )
    )


def distance_and_speed(s: Situations, whom: Pair, by: Yardstick) -> tuple[float, float]:
    """Return a vehicle's distance to its zone's centre [m] and its speed [m/s]."""
    vehicle, lane = whom
    if vehicle < 0:
        distance_m = float(s.lane_hidden_distance_m[0, lane])
        return distance_m, float(hidden_speed(s, 0, lane, by.numbers))
    return float(s.vehicle_distance_m[0, vehicle]), float(s.vehicle_speed_mps[0, vehicle])


class Leader(NamedTuple):
    """Who is ahead on the ego's path, and what room lacks to stop behind, as time at fast speed."""

    whom: Pair
    lacking_s: float


def has_joined(s: Situations, whom: Pair) -> bool:
    """Tell whether a vehicle of a merging lane is on the ego's path already."""
    vehicle, lane = whom
    joined_m = -0.5 * s.lane_zone_m[0, lane]
    return bool(
        vehicle >= 0 and s.lane_merging[0, lane] and s.vehicle_distance_m[0, vehicle] <= joined_m
    )


def ahead_of_ego(s: Situations, whom: Pair) -> float:
    """Return how far a vehicle of a merging lane is ahead of the ego, between centres [m]."""
    vehicle, lane = whom
    return float(
        leader_gap(
            s.lane_ego_distance_m[0, lane],
            s.lane_ego_zone_m[0, lane],
            s.vehicle_distance_m[0, vehicle],
            s.lane_zone_m[0, lane],
        )
    )


def tightest_leader(s: Situations, action: Action, by: Yardstick) -> Leader | None:
    """Return whom the ego has the least room to stop behind after an action; None without any."""
    p = by.numbers
    ego_mps = max(float(s.ego_speed_mps[0]), 0.0)
    going = begin_course(ego_mps, target_of(int(by.in_force), p), target_of(int(action), p), p)
    braking = with_manoeuvre(going, BRAKE, p)
    found = []
    for k in np.flatnonzero(s.vehicle_mask[0]):
        whom = Pair(int(k), int(s.vehicle_lane[0, k]))
        ahead_m = ahead_of_ego(s, whom) - p.position_error_m
        if not has_joined(s, whom) or ahead_m <= 0.0:
            continue
        slow_mps = max(float(s.vehicle_speed_mps[0, k]) - p.speed_error_mps, 0.0)
        room_m = float(leader_margin(braking.fastest, ahead_m, slow_mps, p))
        found.append((room_m, int(s.vehicle_id[0, k]), int(s.lane_id[0, whom.lane]), whom))
    if not found:
        return None
    room_m, *_, whom = min(found)
    return Leader(whom, -room_m / p.fast_mps)


def nearest(s: Situations, action: Action, by: Yardstick) -> Pair:
    """Return who leaves the ego the least time to be gone, seen or hidden; lane -1: nobody.

    Zones that the ego has left, and vehicles that have left theirs, do not count.
    """
    up_mps2 = by.numbers.others_up_mps2
    lanes = [int(k) for k in np.flatnonzero(s.lane_mask[0])]
    leave_s = leave_times(s, int(action), int(by.in_force), GO, by.numbers)
    zone_m, limit_mps = s.lane_zone_m[0], s.lane_speed_limit_mps[0]
    found: list[tuple[float, int, int, Pair]] = []
    hidden_s = reach_time(s.lane_hidden_distance_m[0], zone_m, limit_mps, up_mps2, limit_mps)
    for lane in lanes:
        if leave_s[lane] > 0.0:
            key = float(hidden_s[lane] - leave_s[lane])
            found.append((key, 1, int(s.lane_id[0, lane]), Pair(NOBODY, lane)))
    at = s.vehicle_lane[0]
    to_zone_m, mps = s.vehicle_distance_m[0], s.vehicle_speed_mps[0]
    arrival_s = reach_time(to_zone_m, zone_m[at], mps, up_mps2, limit_mps[at])
    coming = s.vehicle_mask[0] & (to_zone_m + 0.5 * zone_m[at] > 0.0) & (leave_s[at] > 0.0)
    for k in np.flatnonzero(coming):
        key = float(arrival_s[k] - leave_s[at[k]])
        found.append((key, 0, int(s.vehicle_id[0, k]), Pair(int(k), int(at[k]))))
    return min(found)[-1] if found else Pair(NOBODY, NOBODY)
