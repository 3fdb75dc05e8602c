# SPDX-License-Identifier: Apache-2.0
"""What others may do at worst, whatever the ego does (kernels).

Crossing lanes: from its earliest arrival on a vehicle may be in its zone for ever, so a lane is
one number, the earliest arrival of anyone. A vehicle is gone only if it has already left; the one
that may hide at d_o never is.
"""

import math

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.risk.rewards import reach_time
from risk_dqn_planner.safety.assumptions import SafetyNumbers
from risk_dqn_planner.safety.known import Known
from risk_dqn_planner.situation.situations import Floats, Integers, Situations

NOTHING = -1


@kernel
def top_speed(limit_mps: float, start_mps: float, p: SafetyNumbers) -> float:
    """Return the highest speed that a perceived vehicle may reach on its lane."""
    return max(start_mps, limit_mps * p.limit_factor)


@kernel
def hidden_speed(s: Situations, row: int, lane: int, p: SafetyNumbers) -> float:
    """Return the speed of whatever may hide on a lane."""
    return min(float(s.lane_speed_limit_mps[row, lane]) * p.limit_factor, p.hidden_top_mps)


@kernel
def hidden_arrival(s: Situations, row: int, lane: int, p: SafetyNumbers) -> float:
    """Return when the vehicle that may hide at d_o reaches its zone; 0 if it may be there."""
    mps = hidden_speed(s, row, lane, p)
    arrival_s: float = reach_time(
        s.lane_hidden_distance_m[row, lane], s.lane_zone_m[row, lane], mps, p.others_up_mps2, mps
    )
    return arrival_s


@kernel
def vehicle_arrival(
    now_m: float, zone_m: float, high_mps: float, limit_mps: float, p: SafetyNumbers
) -> float:
    """Return when a vehicle may reach its zone at the earliest, infinity once it left.

    high_mps: the highest speed that it may have now.
    """
    if now_m + 0.5 * zone_m <= -p.position_error_m:
        return math.inf
    top_mps = top_speed(limit_mps, high_mps, p)
    arrival_s: float = reach_time(
        now_m - p.position_error_m, zone_m, high_mps, p.others_up_mps2, top_mps
    )
    return arrival_s


@kernel
def earliest_arrivals(
    s: Situations, row: int, known: Known, p: SafetyNumbers, arrival_s: Floats, who: Integers
) -> None:
    """Fill when anyone may reach each crossing lane's zone (M,), and the vehicle's index.

    The index is -1 for a hidden vehicle. Of vehicles that may arrive at the same time the one
    with the lower id is named.
    """
    for lane in range(s.lane_mask.shape[1]):
        arrival_s[lane], who[lane] = math.inf, NOTHING
        if s.lane_mask[row, lane] and not s.lane_merging[row, lane]:
            arrival_s[lane] = hidden_arrival(s, row, lane, p)
    mask, lanes, ids, merging = s.vehicle_mask, s.vehicle_lane, s.vehicle_id, s.lane_merging
    distance_m, high_mps = s.vehicle_distance_m, known.high_mps
    zone_m, limit_mps = s.lane_zone_m, s.lane_speed_limit_mps
    for vehicle in range(mask.shape[1]):
        lane = lanes[row, vehicle]
        if not mask[row, vehicle] or merging[row, lane]:
            continue
        own_s = vehicle_arrival(
            distance_m[row, vehicle],
            zone_m[row, lane],
            high_mps[row, vehicle],
            limit_mps[row, lane],
            p,
        )
        first = who[lane]
        if own_s < arrival_s[lane] or (
            own_s == arrival_s[lane]
            and own_s < math.inf
            and (first == NOTHING or ids[row, vehicle] < ids[row, first])
        ):
            arrival_s[lane], who[lane] = own_s, vehicle


@kernel
def advance(
    start_mps: float, top_mps: float, until_s: float, p: SafetyNumbers
) -> tuple[float, float]:
    """Return way and speed of someone who accelerates as hard as possible until a time."""
    way_m: float = distance_after(until_s, start_mps, top_mps, p.others_up_mps2, 0.0)
    mps: float = speed_after(until_s, start_mps, top_mps, p.others_up_mps2, 0.0)
    return way_m, mps
