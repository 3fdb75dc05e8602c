# SPDX-License-Identifier: Apache-2.0
"""What the sensor sees: a disc less the shadows of convex obstacles, exact in closed form.

A point lies in the shadow of a convex polygon exactly if it is between the two tangents from
the sensor and behind all edges that face the sensor: an intersection of half-planes. A
rectangle has at most two facing edges, so a shadow is four half-planes, some of them twice.
"""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel

Floats = NDArray[np.float64]

HALF_PLANES = 4


@kernel
def _half_plane(shadow: Floats, row: int, x1: float, y1: float, x2: float, y2: float) -> None:
    """Store the half-plane left of the directed line from point 1 to point 2."""
    nx, ny = y1 - y2, x2 - x1
    shadow[row, 0] = nx
    shadow[row, 1] = ny
    shadow[row, 2] = nx * x1 + ny * y1


@kernel
def cast_shadow(corners: Floats, x: float, y: float, shadow: Floats) -> None:
    """Fill the half-planes (4, 3) of the shadow that a rectangle casts from a sensor.

    corners (4, 2) counter-clockwise; sensor at (x, y); a half-plane (nx, ny, c) holds the
    points with nx px + ny py > c. A sensor inside the rectangle sees nothing: four times all.
    """
    faces = 0
    first, last = -1, -1
    # Walk over the edges so that those facing the sensor come out as one chain.
    for k in range(4):
        ax, ay = corners[k, 0], corners[k, 1]
        bx, by = corners[(k + 1) % 4, 0], corners[(k + 1) % 4, 1]
        if (bx - ax) * (y - ay) - (by - ay) * (x - ax) < 0.0:
            _half_plane(shadow, faces, ax, ay, bx, by)
            faces += 1
            if first < 0 or (last + 1) % 4 != k:
                first = k
            if last < 0 or (last + 1) % 4 == k:
                last = k
    if faces == 0:
        for row in range(HALF_PLANES):
            shadow[row, 0], shadow[row, 1], shadow[row, 2] = 0.0, 0.0, -1.0
        return
    if faces == 1:
        shadow[1, 0], shadow[1, 1], shadow[1, 2] = shadow[0, 0], shadow[0, 1], shadow[0, 2]
    # The chain runs counter-clockwise around the rectangle, clockwise as seen from the sensor.
    end = (last + 1) % 4
    _half_plane(shadow, 2, corners[first, 0], corners[first, 1], x, y)
    _half_plane(shadow, 3, x, y, corners[end, 0], corners[end, 1])


@kernel
def point_hidden(
    x: float,
    y: float,
    sensor_x: float,
    sensor_y: float,
    range_m: float,
    shadows: Floats,
    b: int,
    count: int,
) -> bool:
    """Tell whether a point is out of range or in one of `count` shadows b of (B, O, 4, 3).

    The edge of a shadow is still visible.
    """
    dx, dy = x - sensor_x, y - sensor_y
    if dx * dx + dy * dy > range_m * range_m:
        return True
    for o in range(count):
        inside = True
        for row in range(HALF_PLANES):
            along = shadows[b, o, row, 0] * x + shadows[b, o, row, 1] * y
            inside = inside and along > shadows[b, o, row, 2]
        if inside:
            return True
    return False


@kernel
def range_exit(ax: float, ay: float, dx: float, dy: float, range_m: float) -> float:
    """Return the share at which a + t d, relative to the sensor, leaves its range; 2: never."""
    start = ax * ax + ay * ay - range_m * range_m
    if start > 0.0:
        return 0.0
    bx, by = ax + dx, ay + dy
    if bx * bx + by * by <= range_m * range_m:
        return 2.0
    square = dx * dx + dy * dy
    half = ax * dx + ay * dy
    return (math.sqrt(half * half - square * start) - half) / square


@kernel
def shadow_entry(
    shadows: Floats, b: int, o: int, ax: float, ay: float, dx: float, dy: float
) -> float:
    """Return the share of the way a + t d, t in [0, 1], at which it enters a shadow; 2: never.

    Cyrus and Beck 1978. A way that only touches the shadow does not enter it.
    """
    enter, leave = 0.0, 1.0
    for row in range(HALF_PLANES):
        nx, ny = shadows[b, o, row, 0], shadows[b, o, row, 1]
        start = nx * ax + ny * ay - shadows[b, o, row, 2]
        change = nx * dx + ny * dy
        if start + max(change, 0.0) <= 0.0:
            return 2.0
        if change > 0.0:
            enter = max(enter, -start / change)
        elif change < 0.0:
            leave = min(leave, -start / change)
    return enter if enter < leave else 2.0


@kernel
def first_hidden(
    xy: Floats,
    distance: Floats,
    p: int,
    points: int,
    sensor_x: float,
    sensor_y: float,
    range_m: float,
    shadows: Floats,
    b: int,
    count: int,
) -> float:
    """Return the distance at which path p, followed upstream, is no longer seen.

    xy (P, V, 2) and distance (P, V): `points` points from the zone's exit upstream, with their
    distance to the zone's centre; `count` shadows b of (B, O, 4, 3). A path that is seen to its
    end gives the range, also where it is shorter (as risk_dqn_planner.situation.occlusion).
    """
    for k in range(points - 1):
        ax, ay = xy[p, k, 0], xy[p, k, 1]
        dx, dy = xy[p, k + 1, 0] - ax, xy[p, k + 1, 1] - ay
        hidden = range_exit(ax - sensor_x, ay - sensor_y, dx, dy, range_m)
        for o in range(count):
            hidden = min(hidden, shadow_entry(shadows, b, o, ax, ay, dx, dy))
        if hidden <= 1.0:
            return float(distance[p, k] + hidden * (distance[p, k + 1] - distance[p, k]))
    return range_m
