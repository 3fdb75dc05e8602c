# SPDX-License-Identifier: Apache-2.0
"""A trained network as a policy: the action with the highest Q value."""

import numpy as np
import torch
from numpy.typing import NDArray

from risk_dqn_planner.errors import PolicyError
from risk_dqn_planner.policies.base import Action, Decisions, Reason
from risk_dqn_planner.policies.rule_based import RuleBasedConfig, foresee, risks, what_decided
from risk_dqn_planner.situation.situations import Booleans, Floats, Situations
from risk_dqn_planner.state.encoding import StateConfig
from risk_dqn_planner.state.history import StateEncoder


class LearnedPolicy:
    """Greedy policy of a Q network (paper, "arg max_a Q(s, a)").

    The risks that go with a decision are those of Algorithm 1's prediction; the network does
    not see them, an engineer does.
    """

    def __init__(
        self,
        network: torch.nn.Module,
        name: str,
        sha256: str,
        state: StateConfig | None = None,
        foresight: RuleBasedConfig | None = None,
    ) -> None:
        self.network = network
        self.name, self.hash = name, sha256
        self._encoder = StateEncoder(state)
        self._foresight = foresight or RuleBasedConfig()

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide for each situation and remember it.

        Raises PolicyError if the network gives values that are not finite.
        """
        values = self._q_values(self._encoder.encode(situations, restart))
        action = values.argmax(axis=1)
        ahead = foresee(situations, self._foresight)
        vehicle, lane = what_decided(ahead, action)
        return Decisions(
            action=action,
            q_values=values,
            action_risks=risks(ahead),
            reason=np.full(action.shape, Reason.LEARNED, dtype=np.int64),
            critical_vehicle=vehicle,
            critical_lane=lane,
        )

    def _q_values(self, state: NDArray[np.float32]) -> Floats:
        with torch.inference_mode():
            values = self.network(torch.from_numpy(state)).numpy().astype(np.float64)
        return require_values(self.name, values, state.shape[0])


def require_values(name: str, values: Floats, batch: int) -> Floats:
    """Return what a policy's network gave for a batch, if these are Q values (B, 3).

    Raises:
        PolicyError: the policy of this name gives something else.
    """
    if not np.isfinite(values).all():
        raise PolicyError(f"policy {name} gives Q values that are not finite")
    if values.shape != (batch, len(Action)):
        raise PolicyError(
            f"policy {name} gives values of shape {values.shape}, expected {(batch, len(Action))}"
        )
    return np.asarray(values)
