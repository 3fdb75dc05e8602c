# SPDX-License-Identifier: Apache-2.0
"""The policy that a learner has so far, for evaluation during training."""

import numpy as np

from risk_dqn_planner.policies.base import Decisions, Reason
from risk_dqn_planner.situation.situations import Booleans, Situations
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.learning.learner import Learner


class GreedyPolicy:
    """The action of the highest Q-value; risks are left out, for they cost time."""

    name = "learner"
    hash = ""

    def __init__(self, learner: Learner, encoder: StateEncoder) -> None:
        self._learner = learner
        self._encoder = encoder

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide for each situation and remember it."""
        states = self._encoder.encode(situations, restart)
        batch = len(states)
        q_values = self._learner.q_values(states.reshape(batch, -1)).astype(np.float64)
        nothing = np.full(batch, -1, dtype=np.int64)
        return Decisions(
            action=q_values.argmax(axis=1),
            q_values=q_values,
            action_risks=np.full_like(q_values, np.nan),
            reason=np.full(batch, Reason.LEARNED, dtype=np.int64),
            critical_vehicle=nothing,
            critical_lane=nothing,
        )
