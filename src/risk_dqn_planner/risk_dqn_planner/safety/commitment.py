# SPDX-License-Identifier: Apache-2.0
"""The manoeuvre that was last found safe, kept for when nothing is found any more.

What follows an admissible action for one period stays safe as long as the assumptions hold, also
where the check, which judges the present alone, cannot find it again: a place that was seen free
and is hidden now counts as occupied at once. Then the ego carries on with what was verified.
"""

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.safety.course import BRAKE, GO
from risk_dqn_planner.safety.joint_check import NO_MANOEUVRE, JointCheck
from risk_dqn_planner.situation.situations import Booleans, Integers

STOP, FAST = 0, 2


class Commitments:
    """Row by row the rest of the manoeuvre last verified, and the action in force."""

    def __init__(self) -> None:
        self._periods: NDArray[np.int64] = np.empty(0, dtype=np.int64)
        self._action: NDArray[np.int64] = np.empty(0, dtype=np.int64)

    def in_force(self, restart: Booleans) -> Integers:
        """Return the action (B,) decided last; Stop where `restart` (B,) says it is void."""
        if self._action.shape != restart.shape:
            self._periods = np.full(restart.shape, BRAKE)
            self._action = np.full(restart.shape, STOP)
        self._periods[restart] = BRAKE
        self._action[restart] = STOP
        return self._action

    def next_action(self) -> Integers:
        """Return what the verified manoeuvres do now (B,): Stop where there is none."""
        return np.where(self._periods == BRAKE, STOP, FAST)

    def carry_on(self, check: JointCheck, action: Integers) -> None:
        """Take note of the actions (B,) decided, with the manoeuvres that vindicate them.

        An action that is not admissible leaves the manoeuvre before, less a period of it; one
        against it as well leaves braking.
        """
        found = check.periods[np.arange(len(action)), action]
        kept = np.where(self._periods == GO, GO, np.maximum(self._periods - 1, BRAKE))
        kept = np.where(action == self.next_action(), kept, BRAKE)
        self._periods = np.where(found != NO_MANOEUVRE, found, kept)
        self._action = action.copy()

    def keep(self, rows: Integers) -> None:
        """Go on with other rows (B,) of the batch in place of the present ones."""
        self._periods, self._action = self._periods[rows], self._action[rows]

    @property
    def periods(self) -> Integers:
        """How many periods of going are left of the manoeuvre verified last (B,), GO for ever."""
        return self._periods
