# SPDX-License-Identifier: Apache-2.0
"""What every policy is: situations in, actions with their reasons out, for a whole batch."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations


class Decisions(NamedTuple):
    """Decisions for B situations.

    action (B,): Action. q_values (B, 3) and action_risks (B, 3): NaN where there are none; risks
    in [0, 1], 0 safe, 1 fully unsafe. reason (B,): decision.Reason.
    critical_vehicle (B,): index into the N vehicle places, -1 none.
    critical_lane (B,): index into the M lanes, -1 none.
    """

    action: NDArray[np.int64]
    q_values: Floats
    action_risks: Floats
    reason: Integers
    critical_vehicle: Integers
    critical_lane: Integers


class Policy(Protocol):
    """A policy may remember earlier situations; `restart` tells where that memory is void."""

    @property
    def name(self) -> str:
        """Name for logs and messages."""

    @property
    def hash(self) -> str:
        """SHA-256 of the policy's file, or of its configuration where it has no file."""

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide for each situation; `restart` (B,) marks a new episode or a gap in the input."""
