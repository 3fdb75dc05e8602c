# SPDX-License-Identifier: Apache-2.0
"""Sets of places along a line: rows of closed intervals, ascending and apart from one another.

A table holds row r as near[r, :count] and far[r, :count], both (R, K + 1), with room for K
intervals. A set that would need more unites its two closest intervals: it only ever grows.
"""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel

Floats = NDArray[np.float64]

# Intervals that rounding alone keeps apart are one [m].
_TOUCH_M = 1e-9


@kernel
def insert(near: Floats, far: Floats, row: int, count: int, low: float, high: float) -> int:
    """Unite a set of `count` intervals with [low, high]; return the new count.

    The set's intervals may overlap, as long as both their ends ascend.
    """
    # Most come in ascending order, and find room.
    last = count - 1
    if count == 0 or (low > far[row, last] + _TOUCH_M and count < near.shape[1] - 1):
        near[row, count], far[row, count] = low, high
        return count + 1
    if near[row, last] <= low <= far[row, last] + _TOUCH_M:
        far[row, last] = max(far[row, last], high)
        return count
    return _insert_between(near, far, row, count, low, high)


@kernel
def _insert_between(
    near: Floats, far: Floats, row: int, count: int, low: float, high: float
) -> int:
    """Do as `insert`, anywhere."""
    begin = count
    while begin > 0 and far[row, begin - 1] >= low - _TOUCH_M:
        begin -= 1
    end = begin
    while end < count and near[row, end] <= high + _TOUCH_M:
        low, high = min(low, near[row, end]), max(high, far[row, end])
        end += 1
    count = _moved(near, far, row, count, end, begin + 1)
    near[row, begin], far[row, begin] = low, high
    if count == near.shape[1]:
        return unite_closest(near, far, row, count)
    return count


@kernel
def _moved(near: Floats, far: Floats, row: int, count: int, source: int, target: int) -> int:
    """Move the intervals from `source` on to `target` on; return the new count."""
    if target < source:
        for k in range(source, count):
            near[row, k + target - source] = near[row, k]
            far[row, k + target - source] = far[row, k]
    elif target > source:
        for k in range(count - 1, source - 1, -1):
            near[row, k + target - source] = near[row, k]
            far[row, k + target - source] = far[row, k]
    return count + target - source


@kernel
def unite_closest(near: Floats, far: Floats, row: int, count: int) -> int:
    """Unite the two neighbours with the smallest gap between them; return the new count."""
    chosen, smallest = 0, math.inf
    for k in range(count - 1):
        gap = near[row, k + 1] - far[row, k]
        if gap < smallest:
            chosen, smallest = k, gap
    far[row, chosen] = far[row, chosen + 1]
    return _moved(near, far, row, count, chosen + 2, chosen + 1)


@kernel
def intersect(
    near_a: Floats,
    far_a: Floats,
    row_a: int,
    count_a: int,
    near_b: Floats,
    far_b: Floats,
    row_b: int,
    count_b: int,
    near: Floats,
    far: Floats,
    row: int,
) -> int:
    """Write what sets a and b share into row `row` of a third table; return how many intervals.

    The intervals of a and b may overlap, as long as both their ends ascend.
    """
    count, a, b = 0, 0, 0
    room = near.shape[1] - 1
    while a < count_a and b < count_b:
        low = max(near_a[row_a, a], near_b[row_b, b])
        high = min(far_a[row_a, a], far_b[row_b, b])
        if low <= high:
            # As `insert` does, without the call: these come in ascending order.
            if count > 0 and low <= far[row, count - 1] + _TOUCH_M:
                far[row, count - 1] = max(far[row, count - 1], high)
            elif count < room:
                near[row, count], far[row, count] = low, high
                count += 1
            else:
                count = insert(near, far, row, count, low, high)
        if far_a[row_a, a] < far_b[row_b, b]:
            a += 1
        else:
            b += 1
    return count
