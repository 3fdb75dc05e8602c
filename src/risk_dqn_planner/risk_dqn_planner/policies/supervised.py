# SPDX-License-Identifier: Apache-2.0
"""The supervisor: the joint worst-case check around any policy (ours, docs/safety.md)."""

import dataclasses
import enum

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Action, Decisions, Policy, Reason, Supervision
from risk_dqn_planner.policies.fastest_sound import what_forbids
from risk_dqn_planner.policies.fingerprint import fingerprint
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations

# For each proposed action the others in the order in which they stand in: slower ones first.
_INSTEAD: NDArray[np.int64] = np.array(
    [
        [Action.STOP, Action.SLOW, Action.FAST],
        [Action.SLOW, Action.STOP, Action.FAST],
        [Action.FAST, Action.SLOW, Action.STOP],
    ]
)


class SupervisorMode(str, enum.Enum):
    """What the supervisor does about an action that is not sound."""

    OFF = "off"  # nothing is checked
    REPORT = "report"  # the decision says so, and stays
    ENFORCE = "enforce"  # a sound action stands in


def supervisor_mode(name: str) -> SupervisorMode:
    """Return a mode by its name.

    Raises:
        ConfigurationError: there is none of that name.
    """
    try:
        return SupervisorMode(name)
    except ValueError:
        known = ", ".join(mode.value for mode in SupervisorMode)
        raise ConfigurationError(f"supervisor is '{name}', expected one of: {known}") from None


class Supervisor:
    """Any policy, its actions checked for what they leave the ego to do.

    An action that is not sound is replaced by the sound one of the highest Q value, as in training
    under the supervisor; where the policy gives no Q values, by the fastest sound one below it,
    else by the slowest one above. Where the check admits none, the manoeuvre verified last is
    carried on.
    """

    def __init__(
        self,
        policy: Policy,
        mode: SupervisorMode = SupervisorMode.ENFORCE,
        assumptions: SafetyAssumptions | None = None,
    ) -> None:
        self.policy = policy
        self.mode = mode
        self._guard = Guard(assumptions)
        self._hash = fingerprint(
            {"policy": policy.hash, "supervisor": mode.value}
            | dataclasses.asdict(self._guard.assumptions)
        )

    @property
    def assumptions(self) -> SafetyAssumptions:
        """What the soundness rests on."""
        return self._guard.assumptions

    @property
    def name(self) -> str:
        """Name of the policy inside; an enforcing supervisor adds itself."""
        enforcing = self.mode is SupervisorMode.ENFORCE
        return f"{self.policy.name}+supervisor" if enforcing else self.policy.name

    @property
    def hash(self) -> str:
        """SHA-256 of policy and assumptions; of the policy alone where it decides alone."""
        return self._hash if self.mode is SupervisorMode.ENFORCE else self.policy.hash

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Let the policy decide, and check it; at the goal there is nothing to check."""
        decisions = self.policy.decide(situations, restart)
        if self.mode is SupervisorMode.OFF:
            return decisions
        proposed = np.asarray(decisions.action, dtype=np.int64)
        check = self._guard.look(situations, restart)
        allowed = _allowed(self._guard.sound(check), proposed, decisions.q_values)
        at_goal = decisions.reason == Reason.GOAL_REACHED
        unsound = (allowed != proposed) & ~at_goal
        enforced = unsound & (self.mode is SupervisorMode.ENFORCE)
        action = np.where(enforced, allowed, proposed)
        self._guard.decided(check, action)
        vehicle, lane, lacking_s = what_forbids(check, proposed)
        # An admissible action is replaced by none, so whoever forbids it is known.
        hindered = np.where(vehicle >= 0, Reason.VEHICLE, Reason.HIDDEN_VEHICLE)
        objection = (
            Supervision.OVERRULED if self.mode is SupervisorMode.ENFORCE else (Supervision.OBJECTED)
        )
        return decisions._replace(
            action=action,
            reason=np.where(enforced, hindered, decisions.reason),
            critical_vehicle=np.where(unsound, vehicle, decisions.critical_vehicle),
            critical_lane=np.where(unsound, lane, decisions.critical_lane),
            supervision=np.where(unsound, objection, Supervision.AGREED),
            proposed=proposed,
            lacking_s=np.where(unsound, lacking_s, np.nan),
            check=check,
            in_force=self._guard.in_force,
        )


def _allowed(sound: Booleans, proposed: Integers, q_values: Floats) -> Integers:
    """Return the proposed actions (B,) where they are sound (B, 3), else what stands in."""
    rows = np.arange(len(proposed))
    order = _INSTEAD[proposed]
    by_speed = order[rows, sound[rows[:, None], order].argmax(axis=1)]
    by_value = np.where(sound, q_values, -np.inf).argmax(axis=1)
    valued = np.isfinite(q_values).all(axis=1)
    return np.where(sound[rows, proposed], proposed, np.where(valued, by_value, by_speed))
