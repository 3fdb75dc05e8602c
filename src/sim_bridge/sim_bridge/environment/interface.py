# SPDX-License-Identifier: Apache-2.0
"""What the training loop asks of an environment: B episodes side by side, restarted by itself."""

import enum
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

States = NDArray[np.float32]


class Outcome(enum.IntEnum):
    """How an episode ended. A timeout is a truncation: the task would have gone on."""

    RUNNING = 0
    SUCCESS = 1
    COLLISION = 2
    TIMEOUT = 3


class EnvironmentStep(NamedTuple):
    """One step of B environments.

    reward (B,); discount (B,): 0 where the episode terminated, 1 else, also at a time limit.
    final_states (B, F): what the action led to. states (B, F): what to act upon next, which is
    the first state of a new episode where `ended` (B,). outcome (B,): Outcome.
    """

    reward: NDArray[np.float32]
    discount: NDArray[np.float32]
    ended: NDArray[np.bool_]
    outcome: NDArray[np.int64]
    final_states: States
    states: States


class Environment(Protocol):
    """B environments with a state of F numbers and the actions 0, 1, 2."""

    @property
    def batch(self) -> int:
        """B."""

    @property
    def features(self) -> int:
        """F."""

    def reset(self) -> States:
        """Begin the first episode of each environment; return the states (B, F)."""

    def step(self, actions: NDArray[np.int64]) -> EnvironmentStep:
        """Take one action (B,) in each environment."""

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically."""

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over an interrupted run."""
