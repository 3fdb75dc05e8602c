# SPDX-License-Identifier: Apache-2.0
"""Learning from advice: what a slow expert would do in the states that the learner comes to.

The expert is asked wherever the learner gets to (Ross et al. 2011), and its answers are one more
term of the loss beside that of Q-learning (as in Hester et al. 2018): the cross entropy between
the expert's action and the learner's Q-values over a temperature, sound actions alone.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel
from sim_bridge.learning.config import AdviceConfig
from sim_bridge.learning.dense import Array


class Advice(NamedTuple):
    """K states (K, F) with their sound actions (K, 3) and the expert's action (K,)."""

    states: Array
    sound: NDArray[np.bool_]
    action: NDArray[np.int64]


def empty_advice(count: int, features: int) -> Advice:
    """Return room for so much advice."""
    return Advice(
        states=np.zeros((count, features), dtype=np.float32),
        sound=np.zeros((count, 3), dtype=np.bool_),
        action=np.zeros(count, dtype=np.int64),
    )


@allocating_kernel
def _copy_rows(source: Advice, rows: NDArray[np.int64], target: Advice) -> None:
    for k in range(rows.shape[0]):
        target.states[k] = source.states[rows[k]]
        target.sound[k] = source.sound[rows[k]]
        target.action[k] = source.action[rows[k]]


@kernel
def advice_loss(
    q: Array, sound: NDArray[np.bool_], action: NDArray[np.int64], temperature: float, by_q: Array
) -> float:
    """Return the mean cross entropy of Q-values (B, 3), and fill its derivative by them."""
    loss, count = 0.0, q.shape[0]
    by_q[:] = 0.0
    for k in range(count):
        top = -math.inf
        for a in range(q.shape[1]):
            if sound[k, a]:
                top = max(top, q[k, a] / temperature)
        total = 0.0
        for a in range(q.shape[1]):
            if sound[k, a]:
                total += math.exp(q[k, a] / temperature - top)
        for a in range(q.shape[1]):
            if sound[k, a]:
                share = math.exp(q[k, a] / temperature - top) / total
                by_q[k, a] = (share - (1.0 if a == action[k] else 0.0)) / (temperature * count)
        loss += (top + math.log(total) - q[k, action[k]] / temperature) / count
    return loss


class AdviceMemory:
    """The newest advice, drawn from with equal chances; own random numbers."""

    def __init__(self, config: AdviceConfig, features: int, seed: int) -> None:
        self._memory = empty_advice(config.capacity, features)
        self._drawn = empty_advice(config.batch_size, features)
        self._random = np.random.default_rng([seed, 2])
        self._size = 0
        self._next = 0

    def __len__(self) -> int:
        """How much advice is held."""
        return self._size

    def add(self, advice: Advice) -> None:
        """Keep advice, over the oldest; no more at once than there is room for."""
        count, capacity = len(advice.action), len(self._memory.action)
        rows = (self._next + np.arange(count)) % capacity
        for stored, new in zip(_arrays(self._memory), advice, strict=True):
            stored[rows] = new
        self._next = (self._next + count) % capacity
        self._size = min(self._size + count, capacity)

    def sample(self) -> Advice:
        """Draw a batch, with replacement; its arrays are reused by the next draw."""
        rows = self._random.integers(0, self._size, len(self._drawn.action))
        _copy_rows(self._memory, rows, self._drawn)
        return self._drawn

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically."""
        return {
            "memory": [array[: self._size].copy() for array in self._memory],
            "random": self._random.bit_generator.state,
            "next": self._next,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over a state; the capacity must be the one it was saved with."""
        self._size, self._next = len(state["memory"][0]), state["next"]
        for stored, saved in zip(_arrays(self._memory), state["memory"], strict=True):
            stored[: self._size] = saved
        self._random.bit_generator.state = state["random"]


def _arrays(advice: Advice) -> tuple[NDArray[Any], ...]:
    return advice
