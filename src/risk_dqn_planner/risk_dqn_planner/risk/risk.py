# SPDX-License-Identifier: Apache-2.0
"""R_risk of whole situations, now or after a worst-case prediction, as compiled loops.

For each pair of ego and vehicle R_risk(i) = max(R_CSS, R_CSL); R_risk is the least of them
(paper, section "Risk Reward"). The same code judges the situation as it is (horizon 0, for the
reward) and as it may be in a while (for Algorithm 1 and the risks shown with every decision).

On a merging lane a vehicle that has passed the join is not gone: it is the ego's leader (ours,
the paper knows crossings only).
"""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.risk.config import RiskConfig, RiskParameters
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.risk.rewards import leader_reward, safe_leave_reward
from risk_dqn_planner.risk.worst_case import Work, foresee_ego, foresee_others, work_memory
from risk_dqn_planner.situation.common_path import leader_gap
from risk_dqn_planner.situation.situations import Floats, Integers, Situations

__all__ = ["ActionRewards", "RiskAssessment", "RiskConfig", "assess", "predict_actions"]

NOTHING = -1


class RiskAssessment(NamedTuple):
    """R_risk of B situations with its parts, all in [-1, 0].

    vehicle_reward (B, N) and lane_reward (B, M): R_risk of each vehicle and of each lane's
    virtual vehicle, 0 where there is none. total (B,): R_risk.
    critical_vehicle (B,): index of the vehicle that decides, -1 if a virtual one does or none.
    critical_lane (B,): index of the lane of what decides, -1 if the total is 0.
    """

    vehicle_reward: Floats
    lane_reward: Floats
    total: Floats
    critical_vehicle: Integers
    critical_lane: Integers


class ActionRewards(NamedTuple):
    """R_risk (B, 3) of the predicted situation by Action, with the critical indices (B, 3)."""

    total: Floats
    critical_vehicle: Integers
    critical_lane: Integers


class Critical(NamedTuple):
    """The least reward met so far, and what it came from."""

    reward: float
    reach_s: float
    vehicle: int
    lane: int


def assess(situations: Situations, config: RiskConfig, include_hidden: bool) -> RiskAssessment:
    """Return R_risk of each situation as it is now.

    `include_hidden` decides whether virtual vehicles count in the total: False is the paper's
    reward, True its Algorithm 1. `lane_reward` is given in either case.
    """
    batch, vehicles = situations.vehicle_mask.shape
    result = RiskAssessment(
        vehicle_reward=np.zeros((batch, vehicles)),
        lane_reward=np.zeros(situations.lane_mask.shape),
        total=np.empty(batch),
        critical_vehicle=np.empty(batch, dtype=np.int64),
        critical_lane=np.empty(batch, dtype=np.int64),
    )
    assess_into(situations, config.parameters(), include_hidden, result)
    return result


def predict_actions(situations: Situations, config: RiskConfig, horizon_s: float) -> ActionRewards:
    """Return R_risk after `horizon_s` of each action, virtual vehicles included.

    Paper, Algorithm 1: predict(situation, horizon, action), then both conditions of each real
    and virtual vehicle. Only the predicted situation counts, not what lies in between.
    """
    shape = (situations.ego_speed_mps.shape[0], 3)
    result = ActionRewards(np.zeros(shape), np.full(shape, NOTHING), np.full(shape, NOTHING))
    predict_actions_into(situations, config.parameters(), horizon_s, result)
    return result


@allocating_kernel
def assess_into(
    s: Situations, p: RiskParameters, include_hidden: bool, result: RiskAssessment
) -> None:
    """Fill `result` with the assessment of each row; entries of masked vehicles stay."""
    work = work_memory(s.vehicle_mask.shape[1], s.lane_mask.shape[1])
    for row in range(s.ego_speed_mps.shape[0]):
        foresee_others(s, row, 0.0, p, work)
        foresee_ego(s, row, 0.0, s.ego_speed_mps[row], p, work)
        ego_mps = s.ego_speed_mps[row]
        critical = judge_vehicles(s, row, ego_mps, p, work, result.vehicle_reward[row])
        hidden = judge_hidden(s, row, p, work, critical, result.lane_reward[row])
        if include_hidden:
            critical = hidden
        result.total[row] = critical.reward
        result.critical_vehicle[row] = critical.vehicle
        result.critical_lane[row] = critical.lane


@allocating_kernel
def predict_actions_into(
    s: Situations, p: RiskParameters, horizon_s: float, result: ActionRewards
) -> None:
    """Fill `result` with what each action leads to; column by column as in Action."""
    work = work_memory(s.vehicle_mask.shape[1], s.lane_mask.shape[1])
    vehicle_reward = np.empty(s.vehicle_mask.shape[1])
    lane_reward = np.empty(s.lane_mask.shape[1])
    for row in range(s.ego_speed_mps.shape[0]):
        foresee_others(s, row, horizon_s, p, work)
        for action, target_mps in enumerate((0.0, p.ego_slow_mps, p.ego_fast_mps)):
            now_mps = s.ego_speed_mps[row]
            up, down = p.ego_acceleration_mps2, p.ego_braking_mps2
            travel_m = distance_after(horizon_s, now_mps, target_mps, up, down)
            ego_mps = speed_after(horizon_s, now_mps, target_mps, up, down)
            foresee_ego(s, row, travel_m, ego_mps, p, work)
            critical = judge_vehicles(s, row, ego_mps, p, work, vehicle_reward)
            critical = judge_hidden(s, row, p, work, critical, lane_reward)
            result.total[row, action] = critical.reward
            result.critical_vehicle[row, action] = critical.vehicle
            result.critical_lane[row, action] = critical.lane


@kernel
def judge_vehicles(
    s: Situations, row: int, ego_mps: float, p: RiskParameters, work: Work, reward: Floats
) -> Critical:
    """Fill `reward` (N,) and return the least one; of equal ones that which arrives first."""
    critical = Critical(0.0, math.inf, NOTHING, NOTHING)
    for vehicle in range(s.vehicle_mask.shape[1]):
        if not s.vehicle_mask[row, vehicle]:
            continue
        lane = s.vehicle_lane[row, vehicle]
        reach_s = work.reach_s[vehicle]
        if s.lane_merging[row, lane] and reach_s == math.inf:
            gap_m = leader_gap(
                work.ego_distance_m[lane],
                s.lane_ego_zone_m[row, lane],
                work.kept_m[vehicle],
                s.lane_zone_m[row, lane],
            )
            speed_mps = s.vehicle_speed_mps[row, vehicle]
            pair = leader_reward(gap_m, ego_mps, speed_mps, p.ego_braking_mps2, p.leader_distance_m)
        else:
            pair = safe_leave_reward(reach_s, work.leave_s[lane], p.desired_gap_s, p.safe_gap_s)
        pair = max(pair, work.stop_reward[lane])
        reward[vehicle] = pair
        if pair < critical.reward or (
            pair < 0.0
            and pair == critical.reward
            and arrives_first(s, row, vehicle, reach_s, critical)
        ):
            critical = Critical(pair, reach_s, vehicle, lane)
    return critical


@kernel
def arrives_first(s: Situations, row: int, vehicle: int, reach_s: float, other: Critical) -> bool:
    """Tell whether a vehicle comes before another: by time, then by ids, never by place."""
    if reach_s != other.reach_s:
        return reach_s < other.reach_s
    number, other_number = s.vehicle_id[row, vehicle], s.vehicle_id[row, other.vehicle]
    if number != other_number:
        return bool(number < other_number)
    return bool(s.lane_id[row, s.vehicle_lane[row, vehicle]] < s.lane_id[row, other.lane])


@kernel
def judge_hidden(
    s: Situations, row: int, p: RiskParameters, work: Work, critical: Critical, reward: Floats
) -> Critical:
    """Fill `reward` (M,) and return the least one, `critical` included and first if equal."""
    for lane in range(s.lane_mask.shape[1]):
        if not s.lane_mask[row, lane]:
            continue
        reach_s = work.hidden_reach_s[lane]
        pair = safe_leave_reward(reach_s, work.leave_s[lane], p.desired_gap_s, p.safe_gap_s)
        pair = max(pair, work.stop_reward[lane])
        reward[lane] = pair
        if pair < critical.reward or (
            pair < 0.0
            and pair == critical.reward
            and critical.vehicle == NOTHING
            and reach_s < critical.reach_s
        ):
            critical = Critical(pair, reach_s, NOTHING, lane)
    return critical
