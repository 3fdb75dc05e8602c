# SPDX-License-Identifier: Apache-2.0
"""The pieces of R_risk for one pair of ego and vehicle, elementwise (docs/paper.md).

Rewards lie in [-1, 0]: 0 fully safe, -1 fully unsafe. Distances are between centres, to the
centre of the conflict zone, negative once that is passed.
"""

from risk_dqn_planner.compiled import elementwise
from risk_dqn_planner.risk.motion import time_to_cover


@elementwise
def safe_stop_reward(
    ego_distance_m: float,
    stop_line_distance_m: float,
    ego_zone_m: float,
    ego_speed_mps: float,
    braking_mps2: float,
    stop_margin_m: float,
) -> float:
    """Return R_CSS: can the ego still stop before the zone, at best before the stop line?

    Paper, equation of R_CSS, with d_FS = d_e,i - v^2 / (2 a_brake), d_safe = l/2 + margin and
    d_stl,i = d_e,i - d_e,stl (the paper's text misprints an index). The bounds belong to the
    better branch: d_FS = d_stl,i is 0. Where the stop line lies closer to the zone than d_safe
    the middle branch is empty, so that its denominator is never 0.
    """
    rest_m = ego_distance_m - ego_speed_mps * ego_speed_mps / (2.0 * braking_mps2)
    safe_m = 0.5 * ego_zone_m + stop_margin_m
    line_m = ego_distance_m - stop_line_distance_m
    if rest_m < safe_m:
        return -1.0
    if rest_m >= line_m:
        return 0.0
    share = (rest_m - line_m) / (line_m - safe_m)
    return -share * share


@elementwise
def reach_time(
    distance_m: float,
    zone_m: float,
    speed_mps: float,
    acceleration_mps2: float,
    speed_limit_mps: float,
) -> float:
    """Return when a vehicle can reach its zone at the earliest [s]; 0 from there on."""
    to_zone_m = distance_m - 0.5 * zone_m
    time_s: float = time_to_cover(to_zone_m, speed_mps, acceleration_mps2, speed_limit_mps)
    return time_s


@elementwise
def leave_time(
    ego_distance_m: float,
    ego_zone_m: float,
    ego_speed_mps: float,
    acceleration_mps2: float,
    top_speed_mps: float,
) -> float:
    """Return when the ego can have left the zone at the earliest [s]; 0 once it has."""
    to_end_m = ego_distance_m + 0.5 * ego_zone_m
    time_s: float = time_to_cover(to_end_m, ego_speed_mps, acceleration_mps2, top_speed_mps)
    return time_s


@elementwise
def gap_reward(time_gap_s: float, desired_gap_s: float, safe_gap_s: float) -> float:
    """Return R_CSL for t_gap = t_other_reaches - t_ego_leaves.

    Paper, equation of R_CSL; its equation of t_gap has the opposite sign, against its own prose
    ("the ego vehicle can safely leave before the other vehicle can reach it"): the prose holds.
    """
    if time_gap_s < safe_gap_s:
        return -1.0
    if time_gap_s >= desired_gap_s:
        return 0.0
    share = (time_gap_s - desired_gap_s) / (desired_gap_s - safe_gap_s)
    return -share * share


@elementwise
def safe_leave_reward(
    reach_s: float, leave_s: float, desired_gap_s: float, safe_gap_s: float
) -> float:
    """Return R_CSL from both times; an ego that has left (`leave_s` 0) is safe.

    A vehicle that has left is given `reach_s` infinity by the caller, and is safe as well
    (paper, "or if veh_i has already left"). One inside its zone has `reach_s` 0: -1.
    """
    if leave_s <= 0.0:
        return 0.0
    reward: float = gap_reward(reach_s - leave_s, desired_gap_s, safe_gap_s)
    return reward


@elementwise
def leader_reward(
    gap_m: float,
    ego_speed_mps: float,
    speed_mps: float,
    braking_mps2: float,
    leader_distance_m: float,
) -> float:
    """Return 0 if the ego comes to rest behind a leader that brakes as hard, else -1.

    Ours, for merging lanes; the paper knows crossings only. `leader_distance_m` is the least
    distance of the centres. The gap is smallest now if the leader is faster, else at rest. A
    vehicle that is not ahead (`gap_m` <= 0) is a follower and no leader: 0.
    """
    if gap_m <= 0.0:
        return 0.0
    change_m = (speed_mps * speed_mps - ego_speed_mps * ego_speed_mps) / (2.0 * braking_mps2)
    return 0.0 if gap_m + min(change_m, 0.0) >= leader_distance_m else -1.0
