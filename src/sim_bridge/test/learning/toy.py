# SPDX-License-Identifier: Apache-2.0
"""A walk on a line, small enough to know its values by hand."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from sim_bridge.environment.interface import EnvironmentStep, Outcome, States
from sim_bridge.learning.config import EvaluationConfig, LearnerConfig, ReplayConfig, TrainingConfig
from sim_bridge.learning.learner import Learner


class Walk:
    """Positions 0 to `length`: FAST goes on, all else stays; the episode ends at the end.

    Reward 1 a step. It ends as `outcome` says: SUCCESS terminates, TIMEOUT truncates.
    """

    def __init__(self, batch: int, length: int, outcome: Outcome) -> None:
        self.batch = batch
        self.features = length + 1
        self._length = length
        self._outcome = outcome
        self._position = np.zeros(batch, dtype=np.int64)

    def _states(self) -> States:
        return np.eye(self._length + 1, dtype=np.float32)[self._position]

    def reset(self) -> States:
        self._position[:] = 0
        return self._states()

    def step(self, actions: NDArray[np.int64]) -> EnvironmentStep:
        self._position += actions == 2
        final_states = self._states()
        ended = self._position == self._length
        self._position[ended] = 0
        terminated = ended & (self._outcome != Outcome.TIMEOUT)
        return EnvironmentStep(
            reward=np.ones(self.batch, dtype=np.float32),
            discount=1.0 - terminated.astype(np.float32),
            ended=ended,
            outcome=np.where(ended, self._outcome, Outcome.RUNNING).astype(np.int64),
            final_states=final_states,
            states=self._states(),
        )

    def state_dict(self) -> dict[str, Any]:
        return {"position": self._position.copy()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self._position[:] = state["position"]


def table(positions: int) -> nn.Module:
    """One Q-value for each position and action."""
    return nn.Linear(positions, 3, bias=False)


def learner(features: int, config: TrainingConfig, seed: int = 0) -> Learner:
    torch.manual_seed(seed)
    return Learner(config.learner, table(features), table(features))


CONFIGURATION = TrainingConfig(
    steps=2000,
    environments=2,
    batch_size=8,
    warmup_steps=20,
    gamma=0.5,
    replay=ReplayConfig(capacity=200),
    learner=LearnerConfig(learning_rate=0.05, learning_rate_end=0.05),
    evaluation=EvaluationConfig(every_episodes=50),
)
