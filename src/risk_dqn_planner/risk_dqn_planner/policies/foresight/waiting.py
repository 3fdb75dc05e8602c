# SPDX-License-Identifier: Apache-2.0
"""What waiting will cost: from further back the ego needs shorter gaps, but sees less (kernels)."""

import math

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.policies.foresight.creeping import FAR_M, short_of
from risk_dqn_planner.policies.foresight.prediction import hidden_at
from risk_dqn_planner.policies.foresight.task import Places, Task
from risk_dqn_planner.risk.motion import distance_after, speed_after, time_to_cover
from risk_dqn_planner.risk.rewards import reach_time
from risk_dqn_planner.safety.others import hidden_speed
from risk_dqn_planner.situation.situations import Floats

_ROUNDING = 1e-6
# About what the ego may be short of the line that it creeps to.
_SHORTEST_HOP_M = 0.25
# What is left to the line, beside what no hops fill: hops that are not done see nothing.
_ADVANCE = 0.1


@kernel
def free_way(t: Task) -> float:
    """Return the way within which the ego may rest wherever it likes: up to the next zone."""
    s, row = t.s, t.row
    free_m = math.inf
    for m in range(s.lane_mask.shape[1]):
        half_m = 0.5 * s.lane_ego_zone_m[row, m]
        ego_m = s.lane_ego_distance_m[row, m]
        if s.lane_mask[row, m] and (ego_m + half_m > 0.0 or s.lane_merging[row, m]):
            free_m = min(free_m, ego_m - half_m - t.p.zone_margin_m)
    return free_m


@kernel
def find_places(t: Task, places: Places) -> int:
    """Fill where the ego may wait before zones, outside of all others; return their number.

    Zones between which it cannot wait are cleared together.
    """
    s, row = t.s, t.row
    count = 0
    for m in range(s.lane_mask.shape[1]):
        half_m = 0.5 * s.lane_ego_zone_m[row, m]
        rest_m = s.lane_ego_distance_m[row, m] - half_m - t.p.zone_margin_m
        if s.lane_mask[row, m] and rest_m >= 0.0 and is_free(t, rest_m):
            places.rest_m[count], places.joins[count] = rest_m, s.lane_merging[row, m]
            count += 1
    for j in range(count):
        next_m = math.inf
        for other in range(count):
            if places.rest_m[other] > places.rest_m[j] + _ROUNDING:
                next_m = min(next_m, places.rest_m[other])
        places.clear_m[j] = places.rest_m[j]
        for m in range(s.lane_mask.shape[1]):
            end_m = s.lane_ego_distance_m[row, m] + 0.5 * s.lane_ego_zone_m[row, m]
            if s.lane_mask[row, m] and end_m <= next_m:
                places.clear_m[j] = max(places.clear_m[j], end_m)
    return count


@kernel
def is_free(t: Task, rest_m: float) -> bool:
    """Tell whether a place is outside of all zones."""
    s, row = t.s, t.row
    for m in range(s.lane_mask.shape[1]):
        reach_m = 0.5 * s.lane_ego_zone_m[row, m] + t.p.zone_margin_m
        away_m = abs(s.lane_ego_distance_m[row, m] - rest_m)
        if s.lane_mask[row, m] and away_m < reach_m - _ROUNDING:
            return False
    return True


@kernel
def places_ahead(way_m: float, places: Places, count: int) -> int:
    """Return at how many places an ego may yet have to wait that has come so far."""
    ahead = 0
    for j in range(count):
        if places.rest_m[j] >= way_m - _ROUNDING:
            ahead += 1
    return ahead


@kernel
def waiting_price(
    t: Task, way_m: float, speed_mps: float, places: Places, count: int, shortfall_m: Floats
) -> float:
    """Return what a state that has zones before it has still to expect [s], 0 or more.

    It speeds up until it could only just stop at the next place to wait. From there on it needs
    a gap in the traffic, and the longer that is the rarer; and it must see far enough.
    """
    up, down, fast = t.p.ego_up_mps2, t.p.ego_down_mps2, t.p.fast_mps
    stops_m = way_m + 0.5 * speed_mps * speed_mps / down
    rest_m, clear_m, joins, waits = math.inf, 0.0, False, 0
    for j in range(count):
        if stops_m - _ROUNDING <= places.rest_m[j]:
            waits += 1
            if places.rest_m[j] < rest_m:
                rest_m, clear_m, joins = places.rest_m[j], places.clear_m[j], places.joins[j]
    if rest_m == math.inf:
        return 0.0
    chance_s = waits * t.c.chance_s
    # rest - way = (v^2 - v0^2) / 2 up + v^2 / 2 down
    square = (rest_m - way_m + 0.5 * speed_mps * speed_mps / up) / (0.5 / up + 0.5 / down)
    at_mps = min(math.sqrt(max(square, 0.0)), fast)
    from_m = rest_m - 0.5 * at_mps * at_mps / down
    # The decision to go on falls up to a period before the ego cannot stop any more.
    decides_m = from_m - at_mps * t.p.period_s
    if joins or not sees_enough(t, decides_m, at_mps, rest_m, clear_m):
        # A run-up is of no use to join behind a leader, nor where nothing is seen before the ego
        # stands at the line: it will start from rest.
        goal_m = t.s.goal_distance_m[t.row]
        from_rest_s = at_mps / down + time_to_cover(goal_m - rest_m, 0.0, up, fast)
        if not joins:
            left_m = rest_m - stops_m
            chance_s += t.c.creeping_s_per_m * (short_of(shortfall_m, left_m) + _ADVANCE * left_m)
        return float(chance_s + from_rest_s - time_to_cover(goal_m - from_m, at_mps, up, fast))
    least_s = (clear_m - rest_m) / fast + 0.5 * fast / down
    needed_s = time_to_cover(clear_m - from_m, at_mps, up, fast)
    return float(chance_s + t.c.gap_price * max(needed_s - least_s, 0.0))


@kernel
def sees_enough(t: Task, from_m: float, at_mps: float, rest_m: float, clear_m: float) -> bool:
    """Tell whether an ego that goes on from `from_m` with a speed will see far enough for it.

    On its way through the zones between a place to wait and `clear_m`.
    """
    s, row, p = t.s, t.row, t.p
    for m in range(s.lane_mask.shape[1]):
        end_m = s.lane_ego_distance_m[row, m] + 0.5 * s.lane_ego_zone_m[row, m]
        if not s.lane_mask[row, m] or end_m > clear_m or end_m <= rest_m:
            continue
        mps = hidden_speed(s, row, m, p)
        hidden_m = hidden_at(t, m, from_m)
        arrival_s = reach_time(hidden_m, s.lane_zone_m[row, m], mps, p.others_up_mps2, mps)
        leave_s = time_to_cover(end_m - from_m, at_mps, p.ego_up_mps2, p.fast_mps)
        if leave_s + p.safe_gap_s > arrival_s:
            return False
    return True


@kernel
def decimetres_matter(t: Task, places: Places, count: int) -> bool:
    """Tell whether the ego is about to wait where it matters exactly from where it looks."""
    mps = max(t.s.ego_speed_mps[t.row], 0.0)
    stops_m = 0.5 * mps * mps / t.p.ego_down_mps2
    for j in range(count):
        rest_m = places.rest_m[j]
        if -_ROUNDING <= rest_m - stops_m < FAR_M and not places.joins[j]:
            return not sees_enough(t, rest_m - _SHORTEST_HOP_M, 0.0, rest_m, places.clear_m[j])
    return False


@kernel
def nothing_to_decide(
    t: Task, free_m: float, places: Places, count: int, shortfall_m: Floats
) -> bool:
    """Tell whether going fast all through the horizon costs nothing, not even a longer gap."""
    p, now_mps = t.p, max(t.s.ego_speed_mps[t.row], 0.0)
    time_s = t.c.decisions * p.period_s
    way_m = distance_after(time_s, now_mps, p.fast_mps, p.ego_up_mps2, p.ego_down_mps2)
    mps = speed_after(time_s, now_mps, p.fast_mps, p.ego_up_mps2, p.ego_down_mps2)
    if way_m + 0.5 * mps * mps / p.ego_down_mps2 > free_m:
        return False
    price_s: float = waiting_price(t, way_m, mps, places, count, shortfall_m)
    return price_s <= count * t.c.chance_s
