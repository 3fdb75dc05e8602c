# SPDX-License-Identifier: Apache-2.0
"""Prioritised experience replay, proportional variant (Schaul et al. 2016, section 3.3).

Transition i is drawn with probability P(i) = p_i^alpha / sum_k p_k^alpha, p_i = |TD error| +
a floor, and weighted by (N P(i))^-beta, scaled so that the largest weight of a batch is 1.
"""

from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Action
from sim_bridge.learning import sum_tree
from sim_bridge.learning.config import ReplayConfig

Float32s = NDArray[np.float32]
Float64s = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]


class Transitions(NamedTuple):
    """K transitions: in s_tm1 the action a_tm1 gave r_t and led to s_t, worth discount_t.

    s_tm1, s_t (K, F) float32, flattened states; a_tm1 (K,) int64; r_t, discount_t (K,)
    float32. discount_t is 0 where the episode terminated and gamma^n else, also at a time
    limit: termination is data, not a branch. sound_t (K, 3) bool: actions that may be taken in s_t.
    """

    s_tm1: Float32s
    a_tm1: Integers
    r_t: Float32s
    discount_t: Float32s
    s_t: Float32s
    sound_t: Booleans


class Sample(NamedTuple):
    """B drawn transitions, where they are stored (B,), and their importance weights (B,).

    The arrays are reused by the next draw.
    """

    transitions: Transitions
    indices: Integers
    weights: Float32s


def empty_transitions(count: int, features: int) -> Transitions:
    """Return room for `count` transitions of states with `features` numbers."""
    return Transitions(
        s_tm1=np.zeros((count, features), dtype=np.float32),
        a_tm1=np.zeros(count, dtype=np.int64),
        r_t=np.zeros(count, dtype=np.float32),
        discount_t=np.zeros(count, dtype=np.float32),
        s_t=np.zeros((count, features), dtype=np.float32),
        sound_t=np.ones((count, len(Action)), dtype=np.bool_),
    )


def _empty_sample(count: int, features: int) -> Sample:
    return Sample(
        empty_transitions(count, features),
        indices=np.zeros(count, dtype=np.int64),
        weights=np.zeros(count, dtype=np.float32),
    )


@allocating_kernel
def _copy_rows(source: Transitions, rows: Integers, target: Transitions) -> None:
    """Copy transition rows[k] of the source to row k of the target."""
    for k in range(rows.shape[0]):
        row = rows[k]
        target.s_tm1[k] = source.s_tm1[row]
        target.a_tm1[k] = source.a_tm1[row]
        target.r_t[k] = source.r_t[row]
        target.discount_t[k] = source.discount_t[row]
        target.s_t[k] = source.s_t[row]
        target.sound_t[k] = source.sound_t[row]


@kernel
def _draw(
    tree: Float64s,
    size: int,
    uniforms: Float64s,
    beta: float,
    indices: Integers,
    weights: Float32s,
) -> None:
    """Draw one index from each of B equal slices of the total priority, with its weight.

    uniforms (B,) in [0, 1): where in its slice each draw falls.
    """
    count = uniforms.shape[0]
    total = tree[1]
    largest = 0.0
    for k in range(count):
        index = sum_tree.find(tree, (k + uniforms[k]) / count * total)
        indices[k] = index
        weight = (size * sum_tree.value(tree, index) / total) ** -beta
        weights[k] = weight
        largest = max(largest, weight)
    for k in range(count):
        weights[k] /= largest


class PrioritizedReplay:
    """The newest `capacity` transitions with their priorities; own random numbers."""

    def __init__(self, config: ReplayConfig, features: int, seed: int) -> None:
        self._config = config
        self._memory = empty_transitions(config.capacity, features)
        self._tree = sum_tree.empty(config.capacity)
        self._random = np.random.default_rng(seed)
        self._drawn = _empty_sample(0, features)
        self._size = 0
        self._next = 0
        self._highest_priority = 1.0

    def __len__(self) -> int:
        """Number of transitions held."""
        return self._size

    def add(self, transitions: Transitions) -> None:
        """Store K transitions with the highest priority seen so far, over the oldest ones.

        Raises:
            ConfigurationError: K exceeds the capacity.
        """
        count = len(transitions.a_tm1)
        capacity = self._config.capacity
        if count > capacity:
            raise ConfigurationError(
                f"{count} transitions a step do not fit a replay capacity of {capacity}"
            )
        rows = (self._next + np.arange(count)) % capacity
        for stored, new in zip(_arrays(self._memory), transitions, strict=True):
            stored[rows] = new
        sum_tree.assign(
            self._tree, rows, np.full(count, self._highest_priority**self._config.alpha)
        )
        self._next = (self._next + count) % capacity
        self._size = min(self._size + count, capacity)

    def sample(self, count: int, beta: float) -> Sample:
        """Draw `count` transitions in proportion to their priorities, with replacement."""
        if self._drawn.indices.shape[0] != count:
            self._drawn = _empty_sample(count, self._memory.s_t.shape[1])
        transitions, indices, weights = self._drawn
        _draw(self._tree, self._size, self._random.random(count), beta, indices, weights)
        _copy_rows(self._memory, indices, transitions)
        return self._drawn

    def update_priorities(self, indices: Integers, td_errors: Float32s) -> None:
        """Set the priorities of drawn transitions (B,) from their new TD errors (B,)."""
        priorities = np.abs(td_errors).astype(np.float64) + self._config.priority_floor
        self._highest_priority = max(self._highest_priority, float(priorities.max()))
        sum_tree.assign(self._tree, indices, priorities**self._config.alpha)

    def probabilities(self) -> Float64s:
        """Return P(i) of each stored transition (N,), in storage order."""
        leaves = sum_tree.leaves(self._tree)[: self._size]
        return cast(Float64s, leaves / leaves.sum())

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically."""
        size = self._size
        return {
            "memory": [array[:size].copy() for array in self._memory],
            "leaves": sum_tree.leaves(self._tree)[:size].copy(),
            "random": self._random.bit_generator.state,
            "next": self._next,
            "highest_priority": self._highest_priority,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over a state; the capacity must be the one it was saved with."""
        size = len(state["leaves"])
        # Runs from before actions were ruled out have no sound_t: there all of them are.
        for stored, saved in zip(_arrays(self._memory), state["memory"], strict=False):
            stored[:size] = saved
        self._tree[:] = 0.0
        sum_tree.assign(self._tree, np.arange(size), state["leaves"])
        self._random.bit_generator.state = state["random"]
        self._size = size
        self._next = state["next"]
        self._highest_priority = state["highest_priority"]


def _arrays(transitions: Transitions) -> tuple[NDArray[Any], ...]:
    return transitions
