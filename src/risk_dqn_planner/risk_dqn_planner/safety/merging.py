# SPDX-License-Identifier: Apache-2.0
"""Merging lanes, where nobody leaves: whom the ego may have before it and behind it (kernels).

All places are on the path that is common behind the join, relative to the ego's centre now:
positive ahead. A lane's vehicle is no danger if the ego stays before the zone, if it is a leader
behind which the ego comes to rest, or if it is a follower that has room to react.
"""

import math

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.safety.assumptions import SafetyNumbers
from risk_dqn_planner.safety.course import Course, Motion, speed_at, time_at, way_at
from risk_dqn_planner.safety.known import Known
from risk_dqn_planner.safety.others import advance, hidden_speed, top_speed
from risk_dqn_planner.situation.common_path import leader_gap
from risk_dqn_planner.situation.situations import Situations


@kernel
def leader_margin(c: Motion, ahead_m: float, mps: float, p: SafetyNumbers) -> float:
    """Return the room that remains when both have come to rest; minus infinity for no leader.

    The leader brakes from now on, at least as hard as the ego ever does. So its lead in speed only
    ever shrinks, and the room is least now or at rest.
    """
    needed_m = p.between_centres_m + p.clearance_m
    if ahead_m - needed_m < 0.0:
        return -math.inf
    return ahead_m + 0.5 * mps * mps / p.leader_down_mps2 - needed_m - c.rest_m


@kernel
def follower_margin(
    c: Motion,
    ahead_m: float,
    mps: float,
    top_mps: float,
    enter_s: float,
    reaction_s: float,
    gap_m: float,
    p: SafetyNumbers,
) -> float:
    """Return the room that remains, beyond `gap_m`, between the ego and a follower.

    The follower accelerates until `reaction_s` after the ego's entering and brakes from then on.
    It must have the gap when the ego enters, when it begins to brake, and at rest if the ego
    rests; and while the ego does not slow down, braking to the ego's speed must suffice, without
    counting on the ego to become faster: by then it follows the ego like any leader.
    """
    room_m = -ahead_m - p.between_centres_m - gap_m
    way_m, _ = advance(mps, top_mps, enter_s, p)
    margin_m = room_m + way_at(c, enter_s) - way_m
    react_s = enter_s + reaction_s
    way_m, speed_mps = advance(mps, top_mps, react_s, p)
    margin_m = min(margin_m, room_m + way_at(c, react_s) - way_m)
    down = p.follower_down_mps2
    if c.rest_m < math.inf:
        margin_m = min(margin_m, room_m + c.rest_m - way_m - 0.5 * speed_mps * speed_mps / down)
    settled_s = max(react_s, c.slowing_until_s)
    if settled_s < c.t3:
        braking_s = min(settled_s - react_s, speed_mps / down)
        way_m += (speed_mps - 0.5 * down * braking_s) * braking_s
        speed_mps -= down * braking_s
        margin_m = min(margin_m, room_m + way_at(c, settled_s) - way_m)
        closing_mps = max(speed_mps - speed_at(c, settled_s), 0.0)
        needed_m = 0.5 * closing_mps * closing_mps / down
        margin_m = min(margin_m, room_m + way_at(c, settled_s) - way_m - needed_m)
    return margin_m


@kernel
def merging_margin(
    s: Situations,
    row: int,
    lane: int,
    known: Known,
    c: Course,
    p: SafetyNumbers,
    start_m: float,
) -> tuple[float, int, float]:
    """Return the least room of a merging lane [m], whose it is, and where it could do.

    For an ego that enters the zone after `start_m`. Whose: -1 for a hidden vehicle. Where: at
    rest no further than this from now on nobody would forbid it; infinity if nobody does.
    known: see `joint_check`.
    """
    # Who is ahead fears the fastest motion, who is behind the slowest.
    enter_s = time_at(c.slowest, start_m)
    least_m, who = hidden_margin(s, row, lane, c.slowest, enter_s, p), -1
    before_m = start_m - p.zone_margin_m
    bound_m = math.inf if least_m >= 0.0 else before_m
    needed_m = p.between_centres_m + p.clearance_m
    mask, lanes = s.vehicle_mask, s.vehicle_lane
    distance_m, reacted_m = s.vehicle_distance_m, known.reacted_m[row, lane]
    low_mps, high_mps = known.low_mps, known.high_mps
    ego_m, ego_zone_m = s.lane_ego_distance_m[row, lane], s.lane_ego_zone_m[row, lane]
    zone_m, limit_mps = s.lane_zone_m[row, lane], s.lane_speed_limit_mps[row, lane]
    for vehicle in range(mask.shape[1]):
        if not mask[row, vehicle] or lanes[row, vehicle] != lane:
            continue
        now_m = distance_m[row, vehicle]
        ahead_m = leader_gap(ego_m, ego_zone_m, now_m, zone_m)
        slow_mps = float(low_mps[row, vehicle])
        margin_m = leader_margin(c.fastest, ahead_m - p.position_error_m, slow_mps, p)
        mps = float(high_mps[row, vehicle])
        top_mps = top_speed(limit_mps, mps, p)
        reaction_s, gap_m = p.reaction_s, p.follower_gap_m
        if now_m + p.position_error_m <= reacted_m:
            reaction_s, gap_m = 0.0, p.clearance_m
        behind_m = ahead_m + p.position_error_m
        # Who is too far behind to matter more than others needs no closer look.
        far_m = -behind_m - p.between_centres_m - gap_m - top_mps * (enter_s + reaction_s)
        if far_m - 0.5 * top_mps * top_mps / p.follower_down_mps2 >= max(least_m, 0.0):
            continue
        margin_m = max(
            margin_m,
            follower_margin(c.slowest, behind_m, mps, top_mps, enter_s, reaction_s, gap_m, p),
        )
        if margin_m < 0.0:
            ahead_m -= p.position_error_m
            leads = ahead_m >= needed_m
            rest_m = ahead_m + 0.5 * slow_mps * slow_mps / p.leader_down_mps2 - needed_m
            bound_m = min(bound_m, max(rest_m, before_m) if leads else before_m)
        if margin_m < least_m:
            least_m, who = margin_m, vehicle
    return least_m, who, bound_m


@kernel
def hidden_margin(
    s: Situations, row: int, lane: int, c: Motion, enter_s: float, p: SafetyNumbers
) -> float:
    """Return the room of what may hide on a merging lane: a follower that has not seen the ego.

    It comes into sight at once, so it reacts to the ego's entering, or to what it then sees.
    """
    ahead_m = leader_gap(
        s.lane_ego_distance_m[row, lane],
        s.lane_ego_zone_m[row, lane],
        s.lane_hidden_distance_m[row, lane],
        s.lane_zone_m[row, lane],
    )
    mps = hidden_speed(s, row, lane, p)
    return follower_margin(c, ahead_m, mps, mps, enter_s, p.reaction_s, p.follower_gap_m, p)
