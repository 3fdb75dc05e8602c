# SPDX-License-Identifier: Apache-2.0
"""What the training loop asks of an environment: B episodes side by side, one after the other.

An ended episode's true last state is seen before the next one begins, one step later
(Gymnasium calls this "next step autoreset"): learning needs it to bootstrap at a time limit.
"""

import enum
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.situation.situations import Booleans, Integers

States = NDArray[np.float32]


class Outcome(enum.IntEnum):
    """How an episode ended. A timeout is a truncation: the task would have gone on."""

    RUNNING = 0
    SUCCESS = 1
    COLLISION = 2
    TIMEOUT = 3


class EnvironmentStep(NamedTuple):
    """One step of B environments.

    taken (B,): whether the action was taken; it was not where the episode had ended before:
    that environment has begun its next episode instead, and only `states` counts.
    reward (B,); discount (B,): 0 where the episode terminated, 1 else, also at a time limit.
    outcome (B,): Outcome, RUNNING while the episode goes on. states (B, F): what the action led
    to, in an ended episode its true last state. Arrays may be reused by the next step.
    """

    taken: NDArray[np.bool_]
    reward: NDArray[np.float32]
    discount: NDArray[np.float32]
    outcome: NDArray[np.int64]
    states: States


class Environment(Protocol):
    """B environments with a state of F numbers and the actions 0, 1, 2.

    What is not sound must not be taken; at least one action always is.
    """

    @property
    def batch(self) -> int:
        """B."""

    @property
    def features(self) -> int:
        """F."""

    @property
    def sound(self) -> Booleans:
        """Which actions (B, 3) may be taken now: all of them without a supervisor."""

    def advice(self) -> Integers:
        """Return what an adviser would do now (B,); asked only where the training has one."""

    def reset(self) -> States:
        """Begin the first episode of each environment; return the states (B, F)."""

    def step(self, actions: NDArray[np.int64]) -> EnvironmentStep:
        """Take one action (B,) in each environment."""

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically."""

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over an interrupted run."""
