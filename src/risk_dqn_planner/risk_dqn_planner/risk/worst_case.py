# SPDX-License-Identifier: Apache-2.0
"""What others may do at worst, and what the ego can still do, now or a while from now (kernels).

Readings (docs/paper.md): a virtual vehicle sits at d_o, advances at v_o and never leaves. A
predicted vehicle reaches its zone as if it accelerated from now on, but has left it only if it
has left keeping its speed.
"""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.risk.config import RiskParameters
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.risk.rewards import leave_time, reach_time, safe_stop_reward
from risk_dqn_planner.situation.situations import Floats, Situations


class Work(NamedTuple):
    """Memory for one situation at a time, reused row by row.

    What others may do: reach_s (N,), when each may reach its zone, infinity once it has left;
    kept_m (N,), its distance if it keeps its speed; hidden_reach_s (M,), virtual vehicles.
    What the ego can do about each lane: stop_reward (M,), leave_s (M,), ego_distance_m (M,).
    """

    reach_s: Floats
    kept_m: Floats
    hidden_reach_s: Floats
    stop_reward: Floats
    leave_s: Floats
    ego_distance_m: Floats


@allocating_kernel
def work_memory(vehicles: int, lanes: int) -> Work:
    """Return memory for one situation."""
    return Work(
        np.empty(vehicles),
        np.empty(vehicles),
        np.empty(lanes),
        np.empty(lanes),
        np.empty(lanes),
        np.empty(lanes),
    )


@kernel
def foresee_others(
    s: Situations, row: int, horizon_s: float, p: RiskParameters, work: Work
) -> None:
    """Fill what others may do at worst, `horizon_s` from now; times count from then."""
    up = p.traffic_acceleration_mps2
    for lane in range(s.lane_mask.shape[1]):
        limit_mps = s.lane_speed_limit_mps[row, lane]
        distance_m = s.lane_hidden_distance_m[row, lane] - limit_mps * horizon_s
        work.hidden_reach_s[lane] = reach_time(
            distance_m, s.lane_zone_m[row, lane], limit_mps, up, limit_mps
        )
    for vehicle in range(s.vehicle_mask.shape[1]):
        if not s.vehicle_mask[row, vehicle]:
            continue
        lane = s.vehicle_lane[row, vehicle]
        now_m, speed_mps = s.vehicle_distance_m[row, vehicle], s.vehicle_speed_mps[row, vehicle]
        limit_mps, zone_m = s.lane_speed_limit_mps[row, lane], s.lane_zone_m[row, lane]
        work.kept_m[vehicle] = now_m - speed_mps * horizon_s
        if work.kept_m[vehicle] + 0.5 * zone_m <= 0.0:
            work.reach_s[vehicle] = math.inf
            continue
        top_mps = max(speed_mps, limit_mps)
        nearer_m = now_m - distance_after(horizon_s, speed_mps, top_mps, up, 0.0)
        faster_mps = speed_after(horizon_s, speed_mps, top_mps, up, 0.0)
        work.reach_s[vehicle] = reach_time(nearer_m, zone_m, faster_mps, up, limit_mps)


@kernel
def foresee_ego(
    s: Situations, row: int, travel_m: float, ego_mps: float, p: RiskParameters, work: Work
) -> None:
    """Fill what the ego can do about each lane once it has moved by `travel_m`."""
    stop_line_m = s.stop_line_distance_m[row] - travel_m
    for lane in range(s.lane_mask.shape[1]):
        distance_m = s.lane_ego_distance_m[row, lane] - travel_m
        zone_m = s.lane_ego_zone_m[row, lane]
        work.ego_distance_m[lane] = distance_m
        work.stop_reward[lane] = safe_stop_reward(
            distance_m, stop_line_m, zone_m, ego_mps, p.ego_braking_mps2, p.stop_margin_m
        )
        work.leave_s[lane] = leave_time(
            distance_m, zone_m, ego_mps, p.ego_acceleration_mps2, p.ego_fast_mps
        )
