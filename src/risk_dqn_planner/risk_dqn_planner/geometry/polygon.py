# SPDX-License-Identifier: Apache-2.0
"""What makes a polygon usable: it encloses something, and its outline does not cross itself."""

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


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
def _cross(corners: Floats, i: int, j: int, tolerance_m: float) -> bool:
    """Tell whether edges i and j have both ends of each on either side of the other."""
    count = len(corners)
    px, py = corners[i, 0], corners[i, 1]
    qx, qy = corners[(i + 1) % count, 0], corners[(i + 1) % count, 1]
    ax, ay = corners[j, 0], corners[j, 1]
    bx, by = corners[(j + 1) % count, 0], corners[(j + 1) % count, 1]
    if max(ay, by) < min(py, qy) or min(ay, by) > max(py, qy):
        return False
    a, b = _sides(px, py, qx, qy, ax, ay, bx, by)
    if min(a, b) > -tolerance_m or max(a, b) < tolerance_m:
        return False
    p, q = _sides(ax, ay, bx, by, px, py, qx, qy)
    return min(p, q) < -tolerance_m and max(p, q) > tolerance_m


def crossing_edges(corners: Floats, tolerance_m: float) -> tuple[int, int]:
    """Return the first two edges of a polygon (K, 2) that cross, (-1, -1) if none do.

    Edge k begins at corner k. Edges cross if both ends of each lie more than the tolerance to
    either side of the other: outlines that touch themselves, or whose corners are rounded, do not.
    """
    x = corners[:, 0]
    next_x = np.roll(x, -1)
    low_x, high_x = np.minimum(x, next_x), np.maximum(x, next_x)
    return _sweep(corners, low_x, high_x, np.argsort(low_x), tolerance_m)


@kernel
def _sweep(
    corners: Floats, low_x: Floats, high_x: Floats, order: Integers, tolerance_m: float
) -> tuple[int, int]:
    """Compare each edge with those that begin, from left to right, before it ends."""
    count = len(corners)
    first = (count, count)
    for place in range(count):
        one = order[place]
        for other in order[place + 1 :]:
            if low_x[other] > high_x[one]:
                break
            i, j = min(one, other), max(one, other)
            neighbours = j - i == 1 or j - i == count - 1
            if not neighbours and (i, j) < first and _cross(corners, i, j, tolerance_m):
                first = (i, j)
    return first if first[0] < count else (-1, -1)
