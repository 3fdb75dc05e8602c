# SPDX-License-Identifier: Apache-2.0
"""What makes a polygon usable: it encloses something, and its outline does not cross itself."""

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel

Floats = NDArray[np.float64]


@kernel
def enclosed_area_kernel(corners: Floats) -> float:
    """Return the area inside a polygon (K, 2) [m^2], whichever way round it is given."""
    twice = 0.0
    # About the first corner: far from the origin the products would lose all their digits.
    x0, y0 = corners[0, 0], corners[0, 1]
    for k in range(1, len(corners) - 1):
        ax, ay = corners[k, 0] - x0, corners[k, 1] - y0
        bx, by = corners[k + 1, 0] - x0, corners[k + 1, 1] - y0
        twice += ax * by - ay * bx
    return 0.5 * abs(twice)


@kernel
def _sides(
    px: float, py: float, qx: float, qy: float, ax: float, ay: float, bx: float, by: float
) -> tuple[float, float]:
    """Return how far a and b are left of the line from p to q [m]."""
    ux, uy = qx - px, qy - py
    length = np.sqrt(ux * ux + uy * uy)
    if length <= 0.0:
        return 0.0, 0.0
    ux, uy = ux / length, uy / length
    return ux * (ay - py) - uy * (ax - px), ux * (by - py) - uy * (bx - px)


@kernel
def crossing_edges_kernel(corners: Floats, tolerance_m: float) -> tuple[int, int]:
    """Return the first two edges of a polygon (K, 2) that cross, (-1, -1) if none do.

    Edge k begins at corner k. Edges cross if both ends of each lie more than the tolerance to
    either side of the other: outlines that touch themselves, or whose corners are rounded, do not.
    """
    count = len(corners)
    for i in range(count):
        px, py = corners[i, 0], corners[i, 1]
        qx, qy = corners[(i + 1) % count, 0], corners[(i + 1) % count, 1]
        low_x, high_x, low_y, high_y = min(px, qx), max(px, qx), min(py, qy), max(py, qy)
        for j in range(i + 2, count):
            if i == 0 and j == count - 1:
                continue  # neighbours
            ax, ay = corners[j, 0], corners[j, 1]
            bx, by = corners[(j + 1) % count, 0], corners[(j + 1) % count, 1]
            if max(ax, bx) < low_x or min(ax, bx) > high_x:
                continue
            if max(ay, by) < low_y or min(ay, by) > high_y:
                continue
            a, b = _sides(px, py, qx, qy, ax, ay, bx, by)
            if min(a, b) > -tolerance_m or max(a, b) < tolerance_m:
                continue
            p, q = _sides(ax, ay, bx, by, px, py, qx, qy)
            if min(p, q) < -tolerance_m and max(p, q) > tolerance_m:
                return i, j
    return -1, -1
