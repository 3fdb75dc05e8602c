# SPDX-License-Identifier: Apache-2.0
"""The joint check with all that has to be remembered from one decision to the next."""

import numpy as np

from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.commitment import Commitments
from risk_dqn_planner.safety.familiarity import Familiarity
from risk_dqn_planner.safety.joint_check import UNKNOWN, JointCheck, joint_check
from risk_dqn_planner.safety.known import Known
from risk_dqn_planner.safety.speeds import SpeedBounds
from risk_dqn_planner.situation.situations import Booleans, Integers, Situations


class Guard:
    """For each decision call `look`, choose, and call `decided`.

    Where nothing is admissible, `otherwise` is what was verified last: sound all the same.
    Public for reading, of the last look: known, as in `joint_check`, and in_force (B,), where a
    row that restarts is taken to begin with Stop.
    """

    def __init__(self, assumptions: SafetyAssumptions | None = None) -> None:
        self.assumptions = assumptions or SafetyAssumptions()
        self._delayed = self.assumptions.actuation_delay_s > 0.0
        self._commitments = Commitments()
        self._familiarity = Familiarity(self.assumptions)
        self._speeds = SpeedBounds(self.assumptions)
        self.in_force: Integers = np.empty(0, dtype=np.int64)
        self.known = Known(*(np.empty((0, 0)) for _ in Known._fields))

    def look(self, situations: Situations, restart: Booleans) -> JointCheck:
        """Check the actions of B situations; `restart` (B,) marks where the memory is void."""
        self.in_force = self._commitments.in_force(restart)
        # Who takes over does not know what the ego still carries out.
        in_force = np.where(restart, UNKNOWN, self.in_force) if self._delayed else self.in_force
        self.known = Known(
            self._familiarity.reacted_m(situations, restart),
            *self._speeds.look(situations, restart),
        )
        return joint_check(situations, self.assumptions, in_force, self.known)

    def otherwise(self) -> Integers:
        """Return the action (B,) that carries on with the manoeuvre verified last."""
        return self._commitments.next_action()

    def sound(self, check: JointCheck) -> Booleans:
        """Return which actions (B, 3) are sound: the admissible ones, else what was verified."""
        actions = np.arange(check.admissible.shape[1])
        kept = self.otherwise()[:, None] == actions
        return np.where(check.admissible.any(axis=1, keepdims=True), check.admissible, kept)

    def decided(self, check: JointCheck, action: Integers) -> None:
        """Take note of the actions (B,) that will be carried out."""
        self._commitments.carry_on(check, action)

    def keep(self, rows: Integers) -> None:
        """Go on with other rows (B,) of the batch in place of the present ones.

        For searches, in which one situation is followed by several.
        """
        self._commitments.keep(rows)
        self._familiarity.keep(rows)
        self._speeds.keep(rows)

    @property
    def periods(self) -> Integers:
        """What is left of the manoeuvres verified last (B,), as in `JointCheck`."""
        return self._commitments.periods
