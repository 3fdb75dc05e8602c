# SPDX-License-Identifier: Apache-2.0
"""Algorithm 1 of the paper: the fastest action that stays safe for a while."""

import dataclasses
import math
from dataclasses import dataclass, field

import numpy as np

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Action, Decisions, Reason
from risk_dqn_planner.policies.fingerprint import fingerprint
from risk_dqn_planner.risk.risk import ActionRewards, RiskConfig, predict_actions
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations


@dataclass(frozen=True)
class RuleBasedConfig:
    """How far Algorithm 1 looks ahead, and what it holds for safe.

    prediction_steps: decision periods that the worst case is predicted over.
    """

    prediction_steps: int = 4
    decision_period_s: float = 0.5
    risk: RiskConfig = field(default_factory=RiskConfig)

    def __post_init__(self) -> None:
        if self.prediction_steps < 1:
            raise ConfigurationError(
                f"RuleBasedConfig.prediction_steps is {self.prediction_steps}, expected 1 or more"
            )
        if not 0.0 < self.decision_period_s < math.inf:
            raise ConfigurationError(
                f"RuleBasedConfig.decision_period_s is {self.decision_period_s}, "
                "expected a number above 0"
            )

    @property
    def horizon_s(self) -> float:
        """How far the worst case is predicted."""
        return self.prediction_steps * self.decision_period_s


class RuleBasedPolicy:
    """The fastest of fast and slow that is safe after a worst-case prediction, else stop.

    As printed, the loop of Algorithm 1 lacks its break, so that slow would overwrite fast; the
    text holds ("always takes the fastest safe velocity"). Safe means that for every perceived
    and every virtual vehicle R_CSS or R_CSL is 0 in the predicted situation, R_risk = 0.
    """

    name = "rule_based"

    def __init__(self, config: RuleBasedConfig | None = None) -> None:
        self.config = config or RuleBasedConfig()
        self.hash = fingerprint({"policy": self.name} | dataclasses.asdict(self.config))

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:  # noqa: ARG002
        """Decide for each situation; nothing is remembered."""
        ahead = foresee(situations, self.config)
        safe = ahead.total >= 0.0
        action = np.where(
            safe[:, Action.FAST], Action.FAST, np.where(safe[:, Action.SLOW], Action.SLOW, 0)
        )
        vehicle, lane = what_decided(ahead, action)
        hindered = np.where(vehicle >= 0, Reason.VEHICLE, Reason.HIDDEN_VEHICLE)
        return Decisions(
            action=action,
            q_values=np.full(ahead.total.shape, np.nan),
            action_risks=risks(ahead),
            reason=np.where(action == Action.FAST, Reason.CLEAR, hindered),
            critical_vehicle=vehicle,
            critical_lane=lane,
        )


def foresee(situations: Situations, config: RuleBasedConfig) -> ActionRewards:
    """Return the worst case that each action leads to, all vehicles and hidden ones included."""
    return predict_actions(situations, config.risk, config.horizon_s)


def risks(ahead: ActionRewards) -> Floats:
    """Return the risk (B, 3) of each action, 0 safe to 1 fully unsafe."""
    return 0.0 - ahead.total


def what_decided(ahead: ActionRewards, action: Integers) -> tuple[Integers, Integers]:
    """Return the critical vehicle and lane (B,) that forbid the next faster action.

    For FAST there is none faster: what makes FAST itself risky, if anything does.
    """
    at = np.arange(len(action)), np.minimum(action + 1, Action.FAST)
    return ahead.critical_vehicle[at], ahead.critical_lane[at]
