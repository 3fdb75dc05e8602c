# SPDX-License-Identifier: Apache-2.0
"""The fastest action that the joint worst-case check admits (ours, SPEC 4)."""

import dataclasses

import numpy as np

from risk_dqn_planner.policies.base import Action, Decisions, Reason
from risk_dqn_planner.policies.fingerprint import fingerprint
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.commitment import Commitments
from risk_dqn_planner.safety.familiarity import Familiarity
from risk_dqn_planner.safety.joint_check import JointCheck, joint_check
from risk_dqn_planner.situation.situations import Booleans, Integers, Situations


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

    def __init__(self, assumptions: SafetyAssumptions | None = None) -> None:
        self.assumptions = assumptions or SafetyAssumptions()
        self._commitments = Commitments()
        self._familiarity = Familiarity(self.assumptions)
        self._hash = fingerprint({"policy": self.name} | dataclasses.asdict(self.assumptions))

    @classmethod
    def from_config(cls, config: RuleBasedConfig) -> "FastestSoundPolicy":
        """Take over the vehicles and the period of a configuration."""
        return cls(assumptions_of(config))

    @property
    def name(self) -> str:
        """Name for logs and messages."""
        return "fastest_sound"

    @property
    def hash(self) -> str:
        """SHA-256 of the assumptions."""
        return self._hash

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide for each situation; the manoeuvre that vindicates the decision is remembered."""
        in_force = self._commitments.in_force(restart)
        reacted_m = self._familiarity.reacted_m(situations, restart)
        check = joint_check(situations, self.assumptions, in_force, reacted_m)
        action = fastest_admissible(check, self._commitments.next_action())
        self._commitments.carry_on(check, action)
        vehicle, lane = what_forbids(check, action)
        hindered = np.where(vehicle >= 0, Reason.VEHICLE, Reason.HIDDEN_VEHICLE)
        return Decisions(
            action=action,
            q_values=np.full(check.admissible.shape, np.nan),
            action_risks=np.where(check.admissible, 0.0, 1.0),
            reason=np.where(lane < 0, Reason.CLEAR, hindered),
            critical_vehicle=vehicle,
            critical_lane=lane,
        )


def fastest_admissible(check: JointCheck, otherwise: Integers) -> Integers:
    """Return the fastest admissible action (B,), or `otherwise` (B,) where there is none."""
    fastest = Action.FAST - check.admissible[:, ::-1].argmax(axis=1)
    return np.where(check.admissible.any(axis=1), fastest, otherwise)


def what_forbids(check: JointCheck, action: Integers) -> tuple[Integers, Integers]:
    """Return vehicle and lane (B,) that forbid the next faster action; -1 where none is faster."""
    faster = np.minimum(action + 1, Action.FAST)[:, None]
    free = np.take_along_axis(check.admissible, faster, axis=1)[:, 0]
    vehicle = np.take_along_axis(check.critical_vehicle, faster, axis=1)[:, 0]
    lane = np.take_along_axis(check.critical_lane, faster, axis=1)[:, 0]
    return np.where(free, -1, vehicle), np.where(free, -1, lane)
