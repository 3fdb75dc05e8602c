# SPDX-License-Identifier: Apache-2.0
"""Policies that never change their mind: bounds in evaluations, and something simple in tests."""

import numpy as np

from risk_dqn_planner.policies.base import Action, Decisions, Reason, bare_decisions
from risk_dqn_planner.policies.fingerprint import fingerprint
from risk_dqn_planner.situation.situations import Booleans, Situations


class ConstantPolicy:
    """Decides the same action whatever the situation."""

    def __init__(self, action: Action) -> None:
        self.action = action
        self.name = f"always_{action.name.lower()}"
        self.hash = fingerprint({"policy": self.name})

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:  # noqa: ARG002
        """Decide the same for each situation; risks are not looked at."""
        batch = situations.ego_speed_mps.shape[0]
        return bare_decisions(np.full(batch, self.action, dtype=np.int64), Reason.FIXED)
