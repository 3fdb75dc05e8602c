# SPDX-License-Identifier: Apache-2.0
"""Compiled parts of `contact`: which pairs of positions on two lines let footprints touch.

Poses are rows (N, 4) of x, y, cos and sin of the heading. Shapes are (length, width).
"""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.geometry.footprint import footprints_separation
from risk_dqn_planner.geometry.polyline import pose_kernel

Floats = NDArray[np.float64]
Labels = NDArray[np.int64]
Shape = tuple[float, float]

# Resolution of the search along the other line, and how often an interval is narrowed down.
SEARCH_STEP_M = 0.05
# How far the search follows a contact at a time.
MARGIN_M = 0.3
NARROWINGS = 40
GOLDEN = 0.6180339887498949


@allocating_kernel
def poses(xy: Floats, s: Floats, at: Floats) -> Floats:
    """Return the poses (N, 4) at arc lengths `at` (N,) of a polyline."""
    result = np.empty((at.shape[0], 4))
    for i in range(at.shape[0]):
        x, y, heading = pose_kernel(xy, s, at[i])
        result[i, 0], result[i, 1] = x, y
        result[i, 2], result[i, 3] = math.cos(heading), math.sin(heading)
    return result


@kernel
def separation(first: Floats, shape1: Shape, second: Floats, shape2: Shape) -> float:
    """Return the signed gap between footprints at two poses (4,)."""
    return footprints_separation(
        first[0], first[1], first[2], first[3], shape1[0], shape1[1],
        second[0], second[1], second[2], second[3], shape2[0], shape2[1],
    )  # fmt: skip


@allocating_kernel
def touches(
    first: Floats, shape1: Shape, second: Floats, shape2: Shape, step: float
) -> NDArray[np.bool_]:
    """Return (N, M): whether footprints at poses first (N, 4) and second (M, 4) overlap.

    `step` is the distance between neighbouring poses of `second`, so that stretches that are
    too far away to touch are skipped.
    """
    reach = 0.5 * (math.hypot(shape1[0], shape1[1]) + math.hypot(shape2[0], shape2[1]))
    result = np.zeros((first.shape[0], second.shape[0]), dtype=np.bool_)
    for i in range(first.shape[0]):
        j = 0
        while j < second.shape[0]:
            dx = second[j, 0] - first[i, 0]
            dy = second[j, 1] - first[i, 1]
            spare = math.sqrt(dx * dx + dy * dy) - reach
            if spare > 0.0:
                j += 1 + int(spare / step)
                continue
            result[i, j] = separation(first[i], shape1, second[j], shape2) < 0.0
            j += 1
    return result


@allocating_kernel
def label(grid: NDArray[np.bool_]) -> tuple[Labels, int]:
    """Number the connected components (8 neighbours) of a grid; 0 stands for none."""
    rows, columns = grid.shape
    labels = np.zeros((rows, columns), dtype=np.int64)
    stack = np.empty((rows * columns, 2), dtype=np.int64)
    count = 0
    for row in range(rows):
        for column in range(columns):
            if not grid[row, column] or labels[row, column] != 0:
                continue
            count += 1
            labels[row, column] = count
            stack[0, 0], stack[0, 1] = row, column
            size = 1
            while size > 0:
                size -= 1
                r0, c0 = stack[size, 0], stack[size, 1]
                for r in range(max(r0 - 1, 0), min(r0 + 2, rows)):
                    for c in range(max(c0 - 1, 0), min(c0 + 2, columns)):
                        if grid[r, c] and labels[r, c] == 0:
                            labels[r, c] = count
                            stack[size, 0], stack[size, 1] = r, c
                            size += 1
    return labels, count


@kernel
def _gap_at(pose: Floats, shape1: Shape, xy: Floats, s: Floats, shape2: Shape, at: float) -> float:
    x, y, heading = pose_kernel(xy, s, at)
    return footprints_separation(
        pose[0], pose[1], pose[2], pose[3], shape1[0], shape1[1],
        x, y, math.cos(heading), math.sin(heading), shape2[0], shape2[1],
    )  # fmt: skip


@kernel
def least_separation(
    pose: Floats, shape1: Shape, xy: Floats, s: Floats, shape2: Shape, low: float, high: float
) -> tuple[float, float]:
    """Return the least gap between a footprint and one on a line in [low, high], and where."""
    steps = int(math.ceil((high - low) / SEARCH_STEP_M)) + 1  # noqa: RUF046
    best = math.inf
    where = low
    for k in range(steps + 1):
        at = low + (high - low) * k / steps
        gap = _gap_at(pose, shape1, xy, s, shape2, at)
        if gap < best:
            best, where = gap, at
    # Golden section about the best sample: the gap has one valley at this scale.
    left, right = max(low, where - SEARCH_STEP_M), min(high, where + SEARCH_STEP_M)
    for _ in range(NARROWINGS):
        near = right - GOLDEN * (right - left)
        far = left + GOLDEN * (right - left)
        if _gap_at(pose, shape1, xy, s, shape2, near) < _gap_at(pose, shape1, xy, s, shape2, far):
            right = far
        else:
            left = near
    at = 0.5 * (left + right)
    gap = _gap_at(pose, shape1, xy, s, shape2, at)
    return (gap, at) if gap < best else (best, where)


@allocating_kernel
def contact_edge(
    xy1: Floats,
    s1: Floats,
    shape1: Shape,
    xy2: Floats,
    s2: Floats,
    shape2: Shape,
    inside: float,
    step: float,
    limit: float,
    low: float,
    high: float,
    first: float,
    last: float,
) -> float:
    """Return where on line 1 a contact ends, going from `inside` in steps no farther than `limit`.

    The footprint on line 2 may stand anywhere in [low, high], a range that follows the contact
    on the way within [first, last], since near its edge the contact may be narrower than any
    sampling.
    """
    outside = inside
    found = False
    at = np.empty(1)
    while not found:
        if (limit - inside) * step <= 0.0:
            return limit
        outside = inside + step
        if (limit - outside) * step < 0.0:
            outside = limit
        at[0] = outside
        gap, where = least_separation(poses(xy1, s1, at)[0], shape1, xy2, s2, shape2, low, high)
        if gap < 0.0:
            inside = outside
            low = max(min(low, where - MARGIN_M), first)
            high = min(max(high, where + MARGIN_M), last)
        else:
            found = True
    for _ in range(NARROWINGS):
        at[0] = 0.5 * (inside + outside)
        gap, _ = least_separation(poses(xy1, s1, at)[0], shape1, xy2, s2, shape2, low, high)
        if gap < 0.0:
            inside = at[0]
        else:
            outside = at[0]
    return 0.5 * (inside + outside)
