# SPDX-License-Identifier: Apache-2.0
"""A network that is told what is sound, as a policy: the sound action of the highest value.

The action in force counts for a little more than the network says, so that the ego does not change
between actions that are about as good.
"""

import numpy as np
import torch
from numpy.typing import NDArray

from risk_dqn_planner.policies.base import Decisions, Reason, Supervision
from risk_dqn_planner.policies.fastest_sound import what_forbids
from risk_dqn_planner.policies.learned import require_values
from risk_dqn_planner.policies.outlook import Outlook, OutlookConfig
from risk_dqn_planner.policies.rule_based import RuleBasedConfig, foresee, risks, what_decided
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.situations import Booleans, Floats, Situations
from risk_dqn_planner.state.encoding import StateConfig
from risk_dqn_planner.state.history import StateEncoder

# What the reward of its training takes for a change: the values count that once, and this once
# more. Success and speed fall by 0.1 and 0.2% for it, changes by 5%.
SWITCHING_VALUE = 0.05


class SoundLearnedPolicy:
    """Greedy policy of an OutlookDqn among the sound actions.

    It has its supervisor inside, as in training: what is sound is an input of the network, so both
    must be one. `supervision` says where the network valued another action more.
    """

    chooses_sound = True

    def __init__(
        self,
        network: torch.nn.Module,
        name: str,
        sha256: str,
        outlook: OutlookConfig | None = None,
        state: StateConfig | None = None,
        foresight: RuleBasedConfig | None = None,
        assumptions: SafetyAssumptions | None = None,
        switching_value: float = SWITCHING_VALUE,
    ) -> None:
        self.network = network
        self.switching_value = switching_value
        self.name, self.hash = name, sha256
        self._encoder = StateEncoder(state)
        self._outlook = Outlook(assumptions, outlook)
        self._foresight = foresight or RuleBasedConfig()

    @property
    def assumptions(self) -> SafetyAssumptions:
        """What its soundness rests on."""
        return self._outlook.assumptions

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide for each situation and remember it.

        Raises PolicyError if the network gives values that are not finite.
        """
        state = self._encoder.encode(situations, restart)
        views = self._outlook.look(situations, restart)
        values = self._q_values(state, views.inputs)
        values[np.arange(len(values)), views.in_force] += self.switching_value
        proposed = values.argmax(axis=1)
        action = np.where(views.sound, values, -np.inf).argmax(axis=1)
        self._outlook.decided(views, action)
        overruled = action != proposed
        ahead = foresee(situations, self._foresight)
        vehicle, lane = what_decided(ahead, action)
        forbidding, where, lacking_s = what_forbids(views.check, proposed)
        hindered = np.where(forbidding >= 0, Reason.VEHICLE, Reason.HIDDEN_VEHICLE)
        return Decisions(
            action=action,
            q_values=values,
            action_risks=risks(ahead),
            reason=np.where(overruled, hindered, Reason.LEARNED),
            critical_vehicle=np.where(overruled, forbidding, vehicle),
            critical_lane=np.where(overruled, where, lane),
            supervision=np.where(overruled, Supervision.OVERRULED, Supervision.AGREED),
            proposed=proposed,
            lacking_s=np.where(overruled, lacking_s, np.nan),
            check=views.check,
            in_force=views.in_force,
        )

    def _q_values(self, state: NDArray[np.float32], outlook: NDArray[np.float32]) -> Floats:
        with torch.inference_mode():
            values = self.network(torch.from_numpy(state), torch.from_numpy(outlook))
        return require_values(self.name, values.numpy().astype(np.float64), len(state))
