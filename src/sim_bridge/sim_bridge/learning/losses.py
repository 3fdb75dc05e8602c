# SPDX-License-Identifier: Apache-2.0
"""Double Q-learning (van Hasselt et al. 2016) as pure functions of arrays.

The gradient with respect to the network's output is written out: it is one line, and autograd
then starts at the network. Names as in the paper, eq. (3), (4): y target, Q estimate.
"""

from typing import cast

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Integers = NDArray[np.int64]


def double_q_targets(
    r_t: Floats, discount_t: Floats, q_t_online: Floats, q_t_target: Floats
) -> Floats:
    """Return y (B,): the online network chooses the next action, the target one values it.

    r_t, discount_t (B,); q_t_online, q_t_target (B, A) at the next state.
    """
    best = q_t_online.argmax(axis=1)
    return cast(Floats, r_t + discount_t * q_t_target[np.arange(len(best)), best])


def td_errors(q_tm1: Floats, a_tm1: Integers, targets: Floats) -> Floats:
    """Return y - Q(s, a) (B,) for Q-values (B, A) and the actions taken (B,)."""
    return cast(Floats, targets - q_tm1[np.arange(len(a_tm1)), a_tm1])


def weighted_loss(errors: Floats, weights: Floats) -> float:
    """Return the importance-weighted mean of the squared TD errors (B,), eq. (3).

    The paper sums; Adam's step is the same for both.
    """
    return float(np.mean(weights * errors * errors))


def weighted_loss_gradient(
    errors: Floats, weights: Floats, a_tm1: Integers, actions: int
) -> Floats:
    """Return the derivative (B, A) of `weighted_loss` by the Q-values, targets held fixed."""
    gradient = np.zeros((len(errors), actions), dtype=np.float32)
    gradient[np.arange(len(errors)), a_tm1] = -2.0 / len(errors) * weights * errors
    return gradient
