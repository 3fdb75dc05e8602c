# SPDX-License-Identifier: Apache-2.0
"""What a policy decides and why, in the words that go out on the vehicle."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.faults import FaultyInput
from risk_dqn_planner.policies.base import Action, Decisions, Policy, Reason, Supervision
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.policies.supervised import Supervisor
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.risk.rewards import leader_gap, leave_time, reach_time
from risk_dqn_planner.situation.situations import Situations
from risk_dqn_planner.vehicle import EgoLimits

__all__ = ["Action", "Decision", "Reason", "explain", "fault_decision", "target_speed"]

_OBJECTIONS = {Supervision.OBJECTED: "objects to", Supervision.OVERRULED: "overrules"}


@dataclass(frozen=True)
class Decision:
    """One decision with its reasons, as published (SPEC 7).

    q_values and action_risks are (3,) by Action, NaN where the policy has none; a risk is in
    [0, 1], 0 safe, 1 fully unsafe, the negated R_risk of the paper after the action.
    critical_vehicle_id and critical_lane_id name what decided; None where nothing did.
    proposed: the policy's own action where a supervisor checked it, else None.
    faulty_input: what is at fault where the reason is a fault.
    """

    action: Action
    target_speed_mps: float
    reason: Reason
    text: str
    q_values: NDArray[np.float64]
    action_risks: NDArray[np.float64]
    critical_vehicle_id: int | None
    critical_lane_id: int | None
    policy_name: str
    policy_hash: str
    supervision: Supervision = Supervision.OFF
    proposed: Action | None = None
    faulty_input: FaultyInput = FaultyInput.NO_INPUT


def target_speed(action: Action, ego: EgoLimits) -> float:
    """Return the speed that an action asks for [m/s]."""
    return (0.0, ego.slow_mps, ego.fast_mps)[action]


def explain(
    decisions: Decisions,
    situations: Situations,
    index: int,
    policy: Policy,
    config: RuleBasedConfig | None = None,
) -> Decision:
    """Return one of a batch of decisions with ids, target speed and a line of text.

    config: what the policy's risks were predicted with; the times in the text follow from it.
    """
    config = config or RuleBasedConfig()
    action, reason = Action(int(decisions.action[index])), Reason(int(decisions.reason[index]))
    proposer = policy.policy.name if isinstance(policy, Supervisor) else policy.name
    vehicle, lane = int(decisions.critical_vehicle[index]), int(decisions.critical_lane[index])
    if reason is Reason.GOAL_REACHED:
        text = "the goal is reached"
    elif reason is Reason.FIXED:
        text = f"{proposer} decides the same whatever happens"
    elif reason is Reason.LEARNED:
        values = zip(Action, decisions.q_values[index], strict=True)
        listed = ", ".join(f"{each.name} {value:.3g}" for each, value in values)
        text = f"highest value of {proposer} ({listed})"
    else:
        text = "" if lane >= 0 else "no conflict within range"
    supervision, proposed = _supervision(decisions, index)
    if proposed is not None and supervision in _OBJECTIONS:
        text = _joined(text, f"the supervisor {_OBJECTIONS[supervision]} {proposed.name}")
    if lane >= 0:
        one = Situations._make(field[index] for field in situations)
        lacking_s = np.nan if decisions.lacking_s is None else float(decisions.lacking_s[index])
        outlook = _outlook(one, lane, action, proposed, lacking_s, config)
        text = _joined(text, _conflict(one, vehicle, lane, outlook, config))
    return Decision(
        action=action,
        target_speed_mps=target_speed(action, config.risk.ego),
        reason=reason,
        text=f"{action.name}: {text}",
        q_values=decisions.q_values[index].copy(),
        action_risks=decisions.action_risks[index].copy(),
        critical_vehicle_id=int(situations.vehicle_id[index, vehicle]) if vehicle >= 0 else None,
        critical_lane_id=int(situations.lane_id[index, lane]) if lane >= 0 else None,
        policy_name=policy.name,
        policy_hash=policy.hash,
        supervision=supervision,
        proposed=proposed,
    )


def _joined(text: str, more: str) -> str:
    return f"{text}; {more}" if text else more


def _supervision(decisions: Decisions, index: int) -> tuple[Supervision, Action | None]:
    """Return the supervisor's verdict on one decision, and what the policy proposed."""
    if decisions.supervision is None or decisions.proposed is None:
        return Supervision.OFF, None
    return Supervision(int(decisions.supervision[index])), Action(int(decisions.proposed[index]))


def fault_decision(
    reason: Reason,
    text: str,
    policy_name: str = "",
    policy_hash: str = "",
    faulty_input: FaultyInput = FaultyInput.NO_INPUT,
) -> Decision:
    """Return Stop for when no policy could be asked; `text` says why."""
    return Decision(
        action=Action.STOP,
        target_speed_mps=0.0,
        reason=reason,
        text=f"{Action.STOP.name}: {text}",
        q_values=np.full(len(Action), np.nan),
        action_risks=np.full(len(Action), np.nan),
        critical_vehicle_id=None,
        critical_lane_id=None,
        policy_name=policy_name,
        policy_hash=policy_hash,
        faulty_input=faulty_input,
    )


def _conflict(s: Situations, vehicle: int, lane: int, outlook: str, config: RuleBasedConfig) -> str:
    """Say who forbids an action; `s` is one situation, its batch axis gone.

    outlook: what follows for the ego.
    """
    traffic_mps2 = config.risk.traffic.acceleration_mps2
    zone_m, limit_mps = float(s.lane_zone_m[lane]), float(s.lane_speed_limit_mps[lane])
    zone = f"the conflict zone of lane {s.lane_id[lane]}"
    if vehicle < 0:
        hidden_m = float(s.lane_hidden_distance_m[lane])
        reach_s = reach_time(hidden_m, zone_m, limit_mps, traffic_mps2, limit_mps)
        return (
            f"lane {s.lane_id[lane]} hides whatever is beyond {hidden_m:.1f} m; a vehicle there "
            f"at {limit_mps:.1f} m/s reaches the conflict zone in {reach_s:.1f} s, {outlook}"
        )
    who = f"vehicle {s.vehicle_id[vehicle]}"
    distance_m, speed_mps = (
        float(s.vehicle_distance_m[vehicle]),
        float(s.vehicle_speed_mps[vehicle]),
    )
    if s.lane_merging[lane] and distance_m <= -0.5 * zone_m:
        ego_m, ego_zone_m = s.lane_ego_distance_m[lane], s.lane_ego_zone_m[lane]
        ahead_m = leader_gap(ego_m, ego_zone_m, distance_m, zone_m)
        return f"{who} from lane {s.lane_id[lane]} is {ahead_m:.1f} m ahead at {speed_mps:.1f} m/s"
    reach_s = reach_time(distance_m, zone_m, speed_mps, traffic_mps2, limit_mps)
    if reach_s <= 0.0:
        return f"{who} is in {zone}, {outlook}"
    return f"{who} can reach {zone} in {reach_s:.1f} s, {outlook}"


def _outlook(
    s: Situations,
    lane: int,
    action: Action,
    proposed: Action | None,
    lacking_s: float,
    config: RuleBasedConfig,
) -> str:
    """Say what follows for the ego from the action that is forbidden.

    Where the joint check forbids it, `lacking_s` is no NaN: nothing would be left to do. It is 0
    where a policy looks ahead, and does without what is sound.
    """
    if np.isnan(lacking_s):
        return _leaving(s, lane, action, config)
    if lacking_s <= 0.0:
        return "the ego keeps back for a run-up"
    forbidden = Action(min(action + 1, Action.FAST)) if proposed is None else proposed
    by = f" by {lacking_s:.1f} s" if np.isfinite(lacking_s) else ""
    return f"no safe manoeuvre would be left after {forbidden.name}{by}"


def _leaving(s: Situations, lane: int, action: Action, config: RuleBasedConfig) -> str:
    """Say when the ego leaves the zone, with the next faster action as long as predicted."""
    ego = config.risk.ego
    faster = Action(min(action + 1, Action.FAST))
    motion = (
        config.horizon_s,
        float(s.ego_speed_mps),
        target_speed(faster, ego),
        ego.acceleration_mps2,
        ego.braking_mps2,
    )
    leave_s = config.horizon_s + leave_time(
        s.lane_ego_distance_m[lane] - distance_after(*motion),
        s.lane_ego_zone_m[lane],
        speed_after(*motion),
        ego.acceleration_mps2,
        ego.fast_mps,
    )
    gap_s = config.risk.desired_gap_s
    return f"the ego going {faster.name} leaves it in {leave_s:.1f} s (gap wanted: {gap_s:g} s)"
