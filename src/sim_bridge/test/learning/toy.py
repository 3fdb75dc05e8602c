# SPDX-License-Identifier: Apache-2.0
"""A walk on a line, small enough to know its values by hand."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim_bridge.environment.interface import EnvironmentStep, Outcome, States
from sim_bridge.learning.compiled_network import FEATURES, WEIGHTS
from sim_bridge.learning.config import EvaluationConfig, LearnerConfig, ReplayConfig, TrainingConfig
from sim_bridge.learning.dense import Array
from sim_bridge.learning.learner import Learner

CONFIGURATION = TrainingConfig(
    steps=1200,
    environments=2,
    batch_size=8,
    warmup_steps=20,
    gamma=0.5,
    replay=ReplayConfig(capacity=200),
    learner=LearnerConfig(learning_rate=0.002, learning_rate_end=0.0002),
    evaluation=EvaluationConfig(every_episodes=20),
)


def initial_weights(seed: int) -> Array:
    return (0.1 * np.random.default_rng(seed).normal(size=WEIGHTS)).astype(np.float32)


def learner(config: TrainingConfig, seed: int = 0) -> Learner:
    return Learner(config.learner, initial_weights(seed))


def positions(which: NDArray[np.int64]) -> States:
    """States (B, 120) of positions (B,): each lights another of the ego's 15 inputs."""
    states = np.zeros((len(which), FEATURES), dtype=np.float32)
    states[np.arange(len(which)), 8 * which] = 1.0
    return states


class Walk:
    """Positions 0 to `length`: FAST goes on, all else stays; the episode ends at the end.

    Reward 1 a step. It ends as `outcome` says: SUCCESS terminates, TIMEOUT truncates. ruled_out:
    an action that is never sound; `taken` counts what was done.
    """

    features = FEATURES

    def __init__(
        self, batch: int, length: int, outcome: Outcome, ruled_out: int | None = None
    ) -> None:
        self.batch = batch
        self._length = length
        self._outcome = outcome
        self._position = np.zeros(batch, dtype=np.int64)
        self._sound = np.arange(3) != ruled_out
        self.taken = np.zeros(3, dtype=np.int64)
        self._followed: list[int] = []

    @property
    def sound(self) -> NDArray[np.bool_]:
        return np.tile(self._sound, (self.batch, 1))

    def reset(self) -> States:
        self._position[:] = 0
        return positions(self._position)

    def step(self, actions: NDArray[np.int64]) -> EnvironmentStep:
        self.taken += np.bincount(actions, minlength=3)
        self._followed.append(int(actions[0]))
        begin = self._position == self._length
        self._position = np.where(begin, 0, self._position + (actions == 2))
        ended = self._position == self._length
        terminated = ended & (self._outcome != Outcome.TIMEOUT)
        return EnvironmentStep(
            taken=~begin,
            reward=np.ones(self.batch, dtype=np.float32),
            discount=1.0 - terminated.astype(np.float32),
            outcome=np.where(ended, self._outcome, Outcome.RUNNING).astype(np.int64),
            states=positions(self._position),
        )

    def follow(self) -> list[int]:
        """The actions of the first environment, as they come."""
        return self._followed

    def state_dict(self) -> dict[str, Any]:
        return {"position": self._position.copy()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self._position[:] = state["position"]
