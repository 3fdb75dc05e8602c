# SPDX-License-Identifier: Apache-2.0
"""The policy that a learner has so far, for evaluation during training."""

import numpy as np

from risk_dqn_planner.policies.base import Action, Decisions, Reason, bare_decisions
from risk_dqn_planner.policies.outlook import Outlook
from risk_dqn_planner.situation.situations import Booleans, Situations
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.learning.learner import Learner


class GreedyPolicy:
    """The action of the highest Q-value; risks are left out, for they cost time."""

    name = "learner"
    hash = ""

    def __init__(
        self, learner: Learner, encoder: StateEncoder, outlook: Outlook | None = None
    ) -> None:
        """Take the parts; with an outlook sound actions alone are chosen."""
        self._learner = learner
        self._encoder = encoder
        self._outlook = outlook

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide for each situation and remember it."""
        states = self._encoder.encode(situations, restart)
        batch = len(states)
        states = states.reshape(batch, -1)
        sound = np.ones((batch, len(Action)), dtype=np.bool_)
        views = None if self._outlook is None else self._outlook.look(situations, restart)
        if views is not None:
            states, sound = np.concatenate((states, views.inputs), axis=1), views.sound
        q_values = self._learner.q_values(states).astype(np.float64)
        action = np.where(sound, q_values, -np.inf).argmax(axis=1)
        if self._outlook is not None and views is not None:
            self._outlook.decided(views, action)
        return bare_decisions(action, Reason.LEARNED, q_values)
