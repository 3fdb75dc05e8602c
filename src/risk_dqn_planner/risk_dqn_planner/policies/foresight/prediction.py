# SPDX-License-Identifier: Apache-2.0
"""The situations to come: everyone keeps the speed, and the ego sees more from further ahead."""

import math

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.policies.foresight.sight import hidden_from
from risk_dqn_planner.policies.foresight.task import Task, Work
from risk_dqn_planner.safety.joint_check import foresee
from risk_dqn_planner.safety.others import NOTHING, hidden_arrival
from risk_dqn_planner.safety.speeds import error_ahead
from risk_dqn_planner.situation.common_path import leader_gap


@kernel
def predict(t: Task, k: int, w: Work) -> tuple[float, bool]:
    """Fill row k of `ahead`, and when perceived vehicles arrive from then on.

    Returns the way to the end of the last zone, and whether a merging lane matters.
    """
    s, row, a = t.s, t.row, w.ahead
    time_s = k * t.p.period_s
    above_mps = error_ahead(t.p)
    for i in range(s.vehicle_mask.shape[1]):
        a.vehicle_mask[k, i] = s.vehicle_mask[row, i]
        if s.vehicle_mask[row, i]:
            mps = t.known.likely_mps[row, i]
            a.vehicle_id[k, i] = s.vehicle_id[row, i]
            a.vehicle_lane[k, i] = s.vehicle_lane[row, i]
            a.vehicle_speed_mps[k, i] = mps
            a.vehicle_distance_m[k, i] = s.vehicle_distance_m[row, i] - mps * time_s
            w.known.low_mps[k, i] = max(mps - t.p.speed_error_mps, 0.0)
            w.known.high_mps[k, i] = mps + above_mps
            if k == 0:
                w.known.low_mps[k, i] = t.known.low_mps[row, i]
                w.known.high_mps[k, i] = t.known.high_mps[row, i]
    for m in range(s.lane_mask.shape[1]):
        a.lane_mask[k, m] = s.lane_mask[row, m]
        a.lane_merging[k, m] = s.lane_merging[row, m]
        a.lane_speed_limit_mps[k, m] = s.lane_speed_limit_mps[row, m]
        a.lane_ego_zone_m[k, m] = s.lane_ego_zone_m[row, m]
        a.lane_zone_m[k, m] = s.lane_zone_m[row, m]
        a.lane_ego_distance_m[k, m] = s.lane_ego_distance_m[row, m]
        # Where hidden ones may be depends on what the ego sees by then, see `look_from`.
        a.lane_hidden_distance_m[k, m] = math.inf
        w.known.reacted_m[k, m] = t.known.reacted_m[row, m]
    last_m, merging = foresee(a, k, w.known, t.p, w.of_vehicles_s, w.nearest)
    return last_m, merging


@kernel
def look_from(t: Task, k: int, way_m: float, w: Work) -> None:
    """Let row k of `ahead` be seen from further ahead, and fill who arrives when."""
    s, row, a = t.s, t.row, w.ahead
    for m in range(s.lane_mask.shape[1]):
        if not s.lane_mask[row, m]:
            continue
        a.lane_ego_distance_m[k, m] = s.lane_ego_distance_m[row, m] - way_m
        a.lane_hidden_distance_m[k, m] = hidden_at(t, m, way_m)
        if s.lane_merging[row, m]:
            followers_or_not(t, k, m, way_m, w)
            continue
        hidden_s = hidden_arrival(a, k, m, t.p)
        w.arrival_s[m], w.who[m] = w.of_vehicles_s[m], w.nearest[m]
        if hidden_s < w.arrival_s[m]:
            w.arrival_s[m], w.who[m] = hidden_s, NOTHING


@kernel
def hidden_at(t: Task, lane: int, way_m: float) -> float:
    """Return from where on a lane is expected to be hidden from an ego further ahead."""
    distance_m: float = hidden_from(
        t.s.lane_hidden_distance_m[t.row, lane],
        t.s.lane_ego_distance_m[t.row, lane],
        t.corner_m[t.row, lane],
        way_m,
    )
    return distance_m


@kernel
def followers_or_not(t: Task, k: int, lane: int, way_m: float, w: Work) -> None:
    """Once the ego is to be in a lane, leave those behind it out: they had the room to follow.

    That they keep their speed all the same would make every entry end badly.
    """
    s, row, a = t.s, t.row, w.ahead
    ego_m, zone_m = a.lane_ego_distance_m[k, lane], s.lane_ego_zone_m[row, lane]
    inside = way_m > 0.0 and ego_m <= 0.5 * zone_m
    for i in range(s.vehicle_mask.shape[1]):
        if s.vehicle_mask[row, i] and s.vehicle_lane[row, i] == lane:
            gap_m = leader_gap(ego_m, zone_m, a.vehicle_distance_m[k, i], s.lane_zone_m[row, lane])
            a.vehicle_mask[k, i] = gap_m > 0.0 or not inside
    if inside:
        a.lane_hidden_distance_m[k, lane] = math.inf
