# SPDX-License-Identifier: Apache-2.0
"""Turns the centrelines of real maps into lines that a vehicle could follow.

Maps draw turns with a few points, so that headings jump by up to 60 degrees, and lanelets with
a centreline of their own may begin half a metre beside the end of their predecessor's. A
vehicle placed on such a line would flip or drive sideways. Straight lines stay as they are.
"""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel
from risk_dqn_planner.geometry.polyline import arc_lengths

Floats = NDArray[np.float64]

SPACING_M = 0.5
# Headings change over this much of a line to either side of where the map draws a corner.
HALF_WINDOW_M = 1.5
# Points that lie this close to a chord are left out.
CHORD_TOLERANCE_M = 0.005
# A gap between two lanelets is bridged over a length this many times its width.
BRIDGE_RATIO = 3.0


def join(parts: list[Floats]) -> tuple[Floats, list[int]]:
    """Concatenate lines (N_k, D), healing sideways steps between them.

    Returns:
        The points (N, D), and for each part the index of the point at which it begins.
    """
    points = list(parts[0])
    starts = [0]
    for part in parts[1:]:
        rest = list(part)
        gap = _gap(points, rest)
        if gap > 1e-3:
            _bridge(points, rest, BRIDGE_RATIO * gap, starts[-1])
        starts.append(len(points) - 1)
        points.extend(rest[1:])
    return np.array(points), starts


def _gap(points: list[Floats], rest: list[Floats]) -> float:
    """Return how far the next part begins beside or behind the end; 0 for a step ahead."""
    step = rest[0][:2] - points[-1][:2]
    ahead = rest[1][:2] - points[-2][:2]
    ahead = ahead / max(math.hypot(*ahead), 1e-9)
    along = float(step @ ahead)
    aside = float(abs(step[0] * ahead[1] - step[1] * ahead[0]))
    return 0.0 if along >= BRIDGE_RATIO * aside else max(aside, abs(along))


def _bridge(points: list[Floats], rest: list[Floats], reach: float, first: int) -> None:
    """Let both parts meet half-way, without their points nearer than `reach` to the meeting."""
    meeting = 0.5 * (points[-1] + rest[0])
    while len(points) > first + 2 and math.dist(points[-2][:2], meeting[:2]) < reach:
        del points[-2]
    while len(rest) > 2 and math.dist(rest[1][:2], meeting[:2]) < reach:
        del rest[1]
    points[-1] = meeting
    rest[0] = meeting


def smooth(points: Floats) -> tuple[Floats, Floats]:
    """Smooth a line of points (N, D), of which the first two coordinates span the plane.

    Returns:
        Points (K, D) with the same ends, and for each the arc length (K,) on the given line
        that it stems from.
    """
    s = arc_lengths(points)
    count = max(math.ceil(s[-1] / SPACING_M), 2) + 1
    at = np.linspace(0.0, s[-1], count)
    sampled = np.column_stack([np.interp(at, s, column) for column in points.T])
    half = max(1, round(HALF_WINDOW_M / SPACING_M))
    smoothed = _average(_average(sampled, half), half)
    kept = _corners(smoothed, CHORD_TOLERANCE_M)
    return np.ascontiguousarray(smoothed[kept]), at[kept]


@allocating_kernel
def _average(points: Floats, half: int) -> Floats:
    """Average each point with up to `half` neighbours on either side; the ends stay."""
    count = points.shape[0]
    result = np.empty_like(points)
    for i in range(count):
        reach = min(half, i, count - 1 - i)
        for column in range(points.shape[1]):
            total = 0.0
            for k in range(i - reach, i + reach + 1):
                total += points[k, column]
            result[i, column] = total / (2 * reach + 1)
    return result


@allocating_kernel
def _corners(points: Floats, tolerance: float) -> NDArray[np.int64]:
    """Return the indices of points that keep all others within `tolerance` of the chords.

    The chords grow from the start, so that no tie between equal points decides (a rotated
    map must give the same line).
    """
    count = points.shape[0]
    kept = np.empty(count, dtype=np.int64)
    kept[0] = 0
    number = 1
    start = 0
    for end in range(2, count):
        dx = points[end, 0] - points[start, 0]
        dy = points[end, 1] - points[start, 1]
        length = math.sqrt(dx * dx + dy * dy)
        fits = length > 1e-9
        for k in range(start + 1, end):
            if not fits:
                break
            aside = dx * (points[k, 1] - points[start, 1]) - dy * (points[k, 0] - points[start, 0])
            fits = abs(aside) <= tolerance * length
        if not fits:
            start = end - 1
            kept[number] = start
            number += 1
    kept[number] = count - 1
    return kept[: number + 1]
