# SPDX-License-Identifier: Apache-2.0
"""The fastest action that the joint worst-case check admits (ours, docs/safety.md)."""

import dataclasses

import numpy as np

from risk_dqn_planner.policies.base import Action, Decisions, Reason
from risk_dqn_planner.policies.fingerprint import fingerprint
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.safety.joint_check import JointCheck
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations


def assumptions_of(config: RuleBasedConfig) -> SafetyAssumptions:
    """Return the default assumptions with the vehicles and the period of a configuration."""
    risk = config.risk
    return SafetyAssumptions(
        decision_period_s=config.decision_period_s,
        ego=risk.ego,
        traffic=risk.traffic,
        vehicle=risk.vehicle,
    )


class FastestSoundPolicy:
    """The fastest admissible action; where there is none, the manoeuvre verified last."""

    name = "fastest_sound"
    chooses_sound = True

    def __init__(self, assumptions: SafetyAssumptions | None = None) -> None:
        self._guard = Guard(assumptions)
        self.hash = fingerprint({"policy": self.name} | dataclasses.asdict(self.assumptions))

    @classmethod
    def from_config(cls, config: RuleBasedConfig) -> "FastestSoundPolicy":
        """Take over the vehicles and the period of a configuration."""
        return cls(assumptions_of(config))

    @property
    def assumptions(self) -> SafetyAssumptions:
        """What its soundness rests on."""
        return self._guard.assumptions

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide for each situation; the manoeuvre that vindicates the decision is remembered."""
        check = self._guard.look(situations, restart)
        action = Action.FAST - self._guard.sound(check)[:, ::-1].argmax(axis=1)
        self._guard.decided(check, action)
        vehicle, lane, lacking_s = what_forbids(check, np.minimum(action + 1, Action.FAST))
        return sound_decisions(self._guard, check, action, vehicle, lane, lacking_s)


def sound_decisions(
    guard: Guard,
    check: JointCheck,
    action: Integers,
    vehicle: Integers,
    lane: Integers,
    lacking_s: Floats,
) -> Decisions:
    """Return decisions for sound actions (B,), and what kept each from being faster (B,)."""
    hindered = np.where(vehicle >= 0, Reason.VEHICLE, Reason.HIDDEN_VEHICLE)
    return Decisions(
        action=action,
        q_values=np.full(check.admissible.shape, np.nan),
        action_risks=np.where(check.admissible, 0.0, 1.0),
        reason=np.where(lane < 0, Reason.CLEAR, hindered),
        critical_vehicle=vehicle,
        critical_lane=lane,
        lacking_s=lacking_s,
        check=check,
        in_force=guard.in_force,
    )


def what_forbids(check: JointCheck, action: Integers) -> tuple[Integers, Integers, Floats]:
    """Return vehicle, lane and missing time (B,) that forbid actions (B,); -1, 0 if admissible."""
    at = np.arange(len(action)), action
    free, vehicle, lane = check.admissible[at], check.critical_vehicle[at], check.critical_lane[at]
    lacking_s = -check.margin_s[at]
    return np.where(free, -1, vehicle), np.where(free, -1, lane), np.where(free, 0.0, lacking_s)
