# SPDX-License-Identifier: Apache-2.0
"""How much more of each lane the ego will see from further ahead (kernels).

The line of sight past an obstacle's corner, `b` before a lane's centreline and `a` beside the
ego's path, meets the lane at y = a x / (x - b) from an ego that is x before it: 1 / y is linear in
1 / x, so two looks tell a and b. One number a lane is remembered, b; the last look gives a.
"""

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Booleans, Floats, Situations

# Nearer looks than this to the one before say little about the corner.
_LEAST_WAY_M = 0.25
_FURTHEST_M = 200.0
_FURTHEST_SHARE = 0.9


class SightLines:
    """Remembers, row by row, where the corners stand that end the sight along each lane."""

    def __init__(self, nearest_corner_m: float) -> None:
        self._nearest_corner_m = nearest_corner_m
        self._ego_m = np.empty((0, 0))
        self._hidden_m = np.empty((0, 0))
        self._corner_m = np.empty((0, 0))

    def corner_m(self, situations: Situations, restart: Booleans) -> Floats:
        """Return b of each lane (B, M) after another look; to be called once for each decision."""
        shape = situations.lane_mask.shape
        if self._corner_m.shape != shape:
            self._ego_m, self._hidden_m = np.empty(shape), np.empty(shape)
            self._corner_m = np.empty(shape)
            restart = np.ones(shape[0], dtype=np.bool_)
        note_corners(
            situations, restart, self._nearest_corner_m, self._ego_m, self._hidden_m, self._corner_m
        )
        return self._corner_m


@kernel
def note_corners(
    s: Situations,
    restart: Booleans,
    nearest_m: float,
    ego_m: Floats,
    hidden_m: Floats,
    corner_m: Floats,
) -> None:
    """Bring the corners up to date; ego_m, hidden_m (B, M): the look before."""
    for row in range(restart.shape[0]):
        for lane in range(s.lane_mask.shape[1]):
            x, y = s.lane_ego_distance_m[row, lane], s.lane_hidden_distance_m[row, lane]
            if restart[row]:
                corner_m[row, lane] = nearest_m
            elif abs(ego_m[row, lane] - x) < _LEAST_WAY_M:
                continue
            elif min(x, y, ego_m[row, lane], hidden_m[row, lane]) > 0.0:
                slope = (1.0 / y - 1.0 / hidden_m[row, lane]) / (1.0 / x - 1.0 / ego_m[row, lane])
                inverse_a = 1.0 / y - slope / x
                # Behind a corner that the ego has all but passed everything will be seen.
                found_m = -slope / inverse_a if inverse_a > 0.0 else _FURTHEST_M
                corner_m[row, lane] = max(min(found_m, _FURTHEST_SHARE * x), nearest_m)
            ego_m[row, lane], hidden_m[row, lane] = x, y


@kernel
def hidden_from(hidden_m: float, ego_m: float, corner_m: float, way_m: float) -> float:
    """Return where sight will end on a lane once the ego has driven `way_m`; never nearer."""
    if ego_m <= corner_m:
        return hidden_m
    beyond_m = ego_m - way_m - corner_m
    if beyond_m <= 0.0:
        return max(hidden_m, _FURTHEST_M)
    nearer = (ego_m - way_m) / beyond_m * ((ego_m - corner_m) / ego_m)
    return min(hidden_m * max(nearer, 1.0), max(hidden_m, _FURTHEST_M))
