# SPDX-License-Identifier: Apache-2.0
"""What a policy decides and why, in the words that go out on the vehicle."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.explanation.answer import answer_of
from risk_dqn_planner.explanation.fields import NOTHING_EXPLAINED, Explanation
from risk_dqn_planner.explanation.sentence import Facts, sentence
from risk_dqn_planner.explanation.weighing import weigh
from risk_dqn_planner.faults import FaultyInput
from risk_dqn_planner.policies.base import Action, Decisions, Policy, Reason, Supervision
from risk_dqn_planner.policies.fastest_sound import assumptions_of
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.situations import Situations
from risk_dqn_planner.vehicle import EgoLimits

__all__ = ["Action", "Decision", "Reason", "explain", "fault_decision", "target_speed", "text_of"]


@dataclass(frozen=True)
class Decision:
    """One decision with its reasons, as published in Decision.msg.

    q_values and action_risks are (3,) by Action, NaN where the policy has none; a risk is in
    [0, 1], 0 safe, 1 fully unsafe, the negated R_risk of the paper after the action.
    critical_vehicle_id and critical_lane_id: whom the explanation is about; None for nobody.
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
    explanation: Explanation = NOTHING_EXPLAINED
    supervision: Supervision = Supervision.OFF
    proposed: Action | None = None
    faulty_input: FaultyInput = FaultyInput.NO_INPUT


def target_speed(action: Action, ego: EgoLimits) -> float:
    """Return the speed that an action asks for [m/s]."""
    return (0.0, ego.slow_mps, ego.fast_mps)[action]


def text_of(decision: Decision) -> str:
    """Return the words that the fields of a decision give; faults have texts of their own."""
    return sentence(
        Facts(
            action=decision.action,
            reason=decision.reason,
            why=decision.explanation,
            vehicle_id=decision.critical_vehicle_id,
            lane_id=decision.critical_lane_id,
            q_values=decision.q_values.tolist(),
            supervision=decision.supervision,
            proposed=decision.proposed,
        )
    )


def explain(
    decisions: Decisions,
    situations: Situations,
    index: int,
    policy: Policy,
    config: RuleBasedConfig | None = None,
    assumptions: SafetyAssumptions | None = None,
) -> Decision:
    """Return one of a batch of decisions with its explanation and target speed.

    config, assumptions: what the policy's risks were predicted with, and what its check of
    soundness rests on; the times of the explanation follow from them.
    """
    config = config or RuleBasedConfig()
    assumptions = assumptions or assumptions_of(config)
    answer = answer_of(decisions, index)
    one = situations
    if len(situations.ego_speed_mps) > 1:
        one = Situations._make(field[index : index + 1] for field in situations)
    explanation, (vehicle, lane) = weigh(answer, one, config, assumptions)
    decision = Decision(
        action=answer.action,
        target_speed_mps=target_speed(answer.action, config.risk.ego),
        reason=_reason(answer.reason, explanation),
        text="",
        q_values=decisions.q_values[index].copy(),
        action_risks=decisions.action_risks[index].copy(),
        critical_vehicle_id=int(one.vehicle_id[0, vehicle]) if vehicle >= 0 else None,
        critical_lane_id=int(one.lane_id[0, lane]) if lane >= 0 else None,
        policy_name=policy.name,
        policy_hash=policy.hash,
        explanation=explanation,
        supervision=answer.supervision,
        proposed=answer.proposed,
    )
    return replace(decision, text=text_of(decision))


def _reason(given: Reason, explanation: Explanation) -> Reason:
    """Return the reason for whom the explanation names, seen or hidden."""
    if given not in {Reason.VEHICLE, Reason.HIDDEN_VEHICLE}:
        return given
    return Reason.HIDDEN_VEHICLE if explanation.hidden else Reason.VEHICLE


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
