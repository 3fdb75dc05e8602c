# SPDX-License-Identifier: Apache-2.0
"""Sums rewards over n steps before they are stored; with n = 1 it only applies gamma.

At an episode's end, whether by termination or truncation, the unfinished sums are handed out
as they are, each with the discount of the steps it covers.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel
from sim_bridge.learning.replay import Transitions, empty_transitions


class _Pending(NamedTuple):
    """Ring of the last n steps of E environments: (E, n, F), (E, n), ...; held, next (E,)."""

    states: NDArray[np.float32]
    actions: NDArray[np.int64]
    returns: NDArray[np.float32]
    discounts: NDArray[np.float32]
    held: NDArray[np.int64]
    next: NDArray[np.int64]


@allocating_kernel
def _push(
    pending: _Pending,
    step: Transitions,
    taken: NDArray[np.bool_],
    ended: NDArray[np.bool_],
    gamma: float,
    out: Transitions,
) -> int:
    """Take one step of every environment; write completed sums to `out`, return how many."""
    written = 0
    horizon = pending.states.shape[1]
    for e in range(ended.shape[0]):
        if not taken[e]:
            continue
        slot = pending.next[e]
        pending.states[e, slot] = step.s_tm1[e]
        pending.actions[e, slot] = step.a_tm1[e]
        pending.returns[e, slot] = 0.0
        pending.discounts[e, slot] = 1.0
        pending.next[e] = (slot + 1) % horizon
        pending.held[e] += 1
        count = pending.held[e]
        for age in range(count):
            k = (slot - age) % horizon
            pending.returns[e, k] += pending.discounts[e, k] * step.r_t[e]
            pending.discounts[e, k] *= np.float32(gamma) * step.discount_t[e]
        due = count if ended[e] else count - horizon + 1
        for age in range(count - 1, count - 1 - due, -1):
            k = (slot - age) % horizon
            out.s_tm1[written] = pending.states[e, k]
            out.a_tm1[written] = pending.actions[e, k]
            out.r_t[written] = pending.returns[e, k]
            out.discount_t[written] = pending.discounts[e, k]
            out.s_t[written] = step.s_t[e]
            out.sound_t[written] = step.sound_t[e]
            written += 1
        pending.held[e] -= max(due, 0)
    return written


class NStepReturns:
    """Turns single steps of E environments into n-step transitions."""

    def __init__(self, environments: int, n_step: int, gamma: float, features: int) -> None:
        self._gamma = gamma
        self._pending = _Pending(
            states=np.zeros((environments, n_step, features), dtype=np.float32),
            actions=np.zeros((environments, n_step), dtype=np.int64),
            returns=np.zeros((environments, n_step), dtype=np.float32),
            discounts=np.zeros((environments, n_step), dtype=np.float32),
            held=np.zeros(environments, dtype=np.int64),
            next=np.zeros(environments, dtype=np.int64),
        )
        self._out = empty_transitions(environments * n_step, features)

    def push(
        self, step: Transitions, taken: NDArray[np.bool_], ended: NDArray[np.bool_]
    ) -> Transitions:
        """Take one step of each environment in which one was `taken` (E,).

        ended (E,): whether that was the last of its episode.

        The step's discount_t is 1 or 0 (terminated), without gamma. Returns the transitions
        that are complete, oldest first within an environment, as views reused by the next call.
        """
        written = _push(self._pending, step, taken, ended, self._gamma, self._out)
        return Transitions._make(array[:written] for array in self._out)

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically."""
        return {name: array.copy() for name, array in self._pending._asdict().items()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over the sums of an interrupted run."""
        for name, array in self._pending._asdict().items():
            array[:] = state[name]
