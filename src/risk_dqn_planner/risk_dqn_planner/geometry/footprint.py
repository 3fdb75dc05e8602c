# SPDX-License-Identifier: Apache-2.0
"""Vehicle footprints: rectangles about a centre, length along the heading."""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel


@kernel
def footprints_separation(
    x1: float,
    y1: float,
    cos1: float,
    sin1: float,
    length1: float,
    width1: float,
    x2: float,
    y2: float,
    cos2: float,
    sin2: float,
    length2: float,
    width2: float,
) -> float:
    """Return the widest gap that an edge direction shows between two rectangles [m].

    Positions are centres [m]; cos and sin are those of the headings. Negative: they overlap,
    by at most that much (separating axis theorem); positive: at least that far apart.
    """
    dx = x2 - x1
    dy = y2 - y1
    # |cosine| and |sine| of the angle between them: each one's shadow on the other's axes.
    cosine = abs(cos1 * cos2 + sin1 * sin2)
    sine = abs(cos1 * sin2 - sin1 * cos2)
    ahead1 = abs(dx * cos1 + dy * sin1) - 0.5 * (length1 + length2 * cosine + width2 * sine)
    aside1 = abs(dy * cos1 - dx * sin1) - 0.5 * (width1 + length2 * sine + width2 * cosine)
    ahead2 = abs(dx * cos2 + dy * sin2) - 0.5 * (length2 + length1 * cosine + width1 * sine)
    aside2 = abs(dy * cos2 - dx * sin2) - 0.5 * (width2 + length1 * sine + width1 * cosine)
    return max(ahead1, aside1, ahead2, aside2)


@kernel
def footprints_overlap(
    x1: float,
    y1: float,
    heading1: float,
    length1: float,
    width1: float,
    x2: float,
    y2: float,
    heading2: float,
    length2: float,
    width2: float,
) -> bool:
    """Tell whether two rectangles share more than an edge; centres [m], headings [rad]."""
    dx = x2 - x1
    dy = y2 - y1
    reach = 0.5 * (math.hypot(length1, width1) + math.hypot(length2, width2))
    if dx * dx + dy * dy >= reach * reach:
        return False
    cos1, sin1 = math.cos(heading1), math.sin(heading1)
    cos2, sin2 = math.cos(heading2), math.sin(heading2)
    separation = footprints_separation(
        x1, y1, cos1, sin1, length1, width1, x2, y2, cos2, sin2, length2, width2
    )
    return separation < 0.0


@allocating_kernel
def footprint_corners(
    x: float, y: float, heading: float, length: float, width: float
) -> NDArray[np.float64]:
    """Return the corners (4, 2), counter-clockwise from front left [m]."""
    ahead_x, ahead_y = 0.5 * length * math.cos(heading), 0.5 * length * math.sin(heading)
    left_x, left_y = -0.5 * width * math.sin(heading), 0.5 * width * math.cos(heading)
    corners = np.empty((4, 2))
    corners[0, 0], corners[0, 1] = x + ahead_x + left_x, y + ahead_y + left_y
    corners[1, 0], corners[1, 1] = x - ahead_x + left_x, y - ahead_y + left_y
    corners[2, 0], corners[2, 1] = x - ahead_x - left_x, y - ahead_y - left_y
    corners[3, 0], corners[3, 1] = x + ahead_x - left_x, y + ahead_y - left_y
    return corners
