# SPDX-License-Identifier: Apache-2.0
"""Which followers have seen the ego in their lane for long enough to have reacted.

A driver who has just met the ego may still accelerate for a reaction time; one who has been
behind it for longer already drives as behind any leader.
"""

import math
from collections import deque

import numpy as np

from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations


class Familiarity:
    """Remembers, row by row, how far each lane was seen while the ego was in it."""

    def __init__(self, assumptions: SafetyAssumptions) -> None:
        period_s = assumptions.decision_period_s
        self._decisions = max(math.ceil(assumptions.follower_reaction_s / period_s - 1e-9), 0)
        self._elapsed_s = self._decisions * period_s
        self._limit_factor = assumptions.speed_limit_factor
        self._seen_m: deque[Floats] = deque(maxlen=self._decisions + 1)

    def reacted_m(self, situations: Situations, restart: Booleans) -> Floats:
        """Return how near vehicles must be to have reacted (B, M), see `joint_check`.

        A vehicle that is so near now was in the part of the lane that was seen then, and the ego
        was in its lane. To be called once for each decision.
        """
        half_m = 0.5 * situations.lane_ego_zone_m
        inside = situations.lane_merging & (situations.lane_ego_distance_m <= half_m)
        seen_m = np.where(inside, situations.lane_hidden_distance_m, -np.inf)
        if self._seen_m and self._seen_m[0].shape != seen_m.shape:
            self._seen_m.clear()
        for earlier in self._seen_m:
            earlier[restart] = -np.inf
        self._seen_m.append(seen_m)
        if len(self._seen_m) <= self._decisions:
            return np.full(seen_m.shape, -np.inf)
        speed_mps = situations.lane_speed_limit_mps * self._limit_factor
        return np.asarray(self._seen_m[0] - speed_mps * self._elapsed_s)

    def keep(self, rows: Integers) -> None:
        """Go on with other rows (B,) of the batch in place of the present ones."""
        self._seen_m = deque((seen_m[rows] for seen_m in self._seen_m), self._decisions + 1)
