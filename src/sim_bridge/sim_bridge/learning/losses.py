# SPDX-License-Identifier: Apache-2.0
"""Double Q-learning (van Hasselt et al. 2016), transition by transition, as pure functions.

Names as in the paper, eq. (3) and (4): y is the target, Q the estimate.
"""

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel

Array = NDArray[np.float32]
Booleans = NDArray[np.bool_]


@kernel
def double_q_target(r_t: float, discount_t: float, q_t_online: Array, q_t_target: Array) -> float:
    """Return y: the online network chooses the next action, the target network values it.

    q_t_online, q_t_target (A,): Q-values of the next state. discount_t is 0 after termination.
    """
    value: float = r_t + discount_t * q_t_target[np.argmax(q_t_online)]
    return value


@kernel
def rule_out(q: Array, sound: Booleans) -> None:
    """Make sure that no action is chosen by its Q-values (A,) unless it is sound (A,)."""
    for action in range(q.shape[0]):
        if not sound[action]:
            q[action] = -np.inf


@kernel
def weighted_loss(td_error: float, weight: float, batch: int) -> float:
    """Return a transition's share of the importance-weighted mean square error, eq. (3).

    td_error: y - Q(s, a). The paper sums over the batch; Adam's step is the same for both.
    """
    return weight * td_error * td_error / batch


@kernel
def weighted_loss_slope(td_error: float, weight: float, batch: int) -> float:
    """Return the derivative of `weighted_loss` by Q(s, a), with the target held fixed."""
    return -2.0 * weight * td_error / batch
