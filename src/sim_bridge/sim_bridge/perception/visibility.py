# SPDX-License-Identifier: Apache-2.0
"""What the sensor sees: a disc less the shadows of convex obstacles, exact in closed form.

A point lies in the shadow of a convex polygon exactly if it is between the two tangents from
the sensor and behind all edges that face the sensor: an intersection of half-planes. A
rectangle has at most two facing edges, so a shadow is four half-planes, some of them twice.
"""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Plane = tuple[float, float, float]
Planes = tuple[Plane, Plane, Plane, Plane]

HALF_PLANES = 4


@kernel
def _left_of(x1: float, y1: float, x2: float, y2: float) -> tuple[float, float, float]:
    """Return the half-plane left of the directed line from point 1 to point 2."""
    nx, ny = y1 - y2, x2 - x1
    return nx, ny, nx * x1 + ny * y1


@kernel
def cast_shadow(
    catalogue: Floats, side: int, k: int, x: float, y: float, shadows: Floats, b: int, o: int
) -> None:
    """Fill shadow (b, o) of (B, O, 4, 3): the half-planes of what a rectangle hides.

    The rectangle is (side, k) of a catalogue (2, K, 4, 2) of corners, counter-clockwise; the sensor
    is at (x, y). A half-plane (nx, ny, c) holds the points with nx px + ny py > c. A sensor
    inside the rectangle sees nothing: four times all.
    """
    # With its first corner as origin and the edges from there as units of u and v (to its second
    # and to its last corner) the rectangle is 0 <= u, v <= 1.
    ox, oy = catalogue[side, k, 0, 0], catalogue[side, k, 0, 1]
    ux, uy = catalogue[side, k, 1, 0] - ox, catalogue[side, k, 1, 1] - oy
    vx, vy = catalogue[side, k, 3, 0] - ox, catalogue[side, k, 3, 1] - oy
    uu, vv = ux * ux + uy * uy, vx * vx + vy * vy
    along_u, along_v = (x - ox) * ux + (y - oy) * uy, (x - ox) * vx + (y - oy) * vy
    # Beyond which side of the rectangle the sensor is, -1, 0 or 1; written without branches, which
    # a processor could not foresee.
    beyond_u = (1.0 if along_u > uu else 0.0) - (1.0 if along_u < 0.0 else 0.0)
    beyond_v = (1.0 if along_v > vv else 0.0) - (1.0 if along_v < 0.0 else 0.0)
    # Behind the edges that face the sensor; where only one does, twice behind that.
    behind_u = -(ox * ux + oy * uy + uu) if beyond_u > 0.0 else ox * ux + oy * uy
    behind_v = -(ox * vx + oy * vy + vv) if beyond_v > 0.0 else ox * vx + oy * vy
    only_u, only_v = beyond_v == 0.0, beyond_u == 0.0
    shadows[b, o, 0, 0] = -beyond_v * vx if only_v else -beyond_u * ux
    shadows[b, o, 0, 1] = -beyond_v * vy if only_v else -beyond_u * uy
    shadows[b, o, 0, 2] = behind_v if only_v else behind_u
    shadows[b, o, 1, 0] = -beyond_u * ux if only_u else -beyond_v * vx
    shadows[b, o, 1, 1] = -beyond_u * uy if only_u else -beyond_v * vy
    shadows[b, o, 1, 2] = behind_u if only_u else behind_v
    # The facing edges run counter-clockwise from a first to a last corner, where the tangents are.
    first_u = 1.0 if (beyond_v > 0.0) | (only_u & (beyond_u > 0.0)) else 0.0
    first_v = 1.0 if (beyond_u < 0.0) | (only_v & (beyond_v > 0.0)) else 0.0
    last_u = 1.0 if (beyond_v < 0.0) | (only_u & (beyond_u > 0.0)) else 0.0
    last_v = 1.0 if (beyond_u > 0.0) | (only_v & (beyond_v > 0.0)) else 0.0
    first = ox + first_u * ux + first_v * vx, oy + first_u * uy + first_v * vy
    last = ox + last_u * ux + last_v * vx, oy + last_u * uy + last_v * vy
    plane = _left_of(first[0], first[1], x, y)
    shadows[b, o, 2, 0], shadows[b, o, 2, 1], shadows[b, o, 2, 2] = plane
    plane = _left_of(x, y, last[0], last[1])
    shadows[b, o, 3, 0], shadows[b, o, 3, 1], shadows[b, o, 3, 2] = plane
    if only_u and only_v:
        for row in range(HALF_PLANES):
            shadows[b, o, row, 0], shadows[b, o, row, 1], shadows[b, o, row, 2] = 0.0, 0.0, -1.0


@kernel
def cast_shadows(
    catalogue: Floats,
    obstacle: Integers,
    b: int,
    x: float,
    y: float,
    shadows: Floats,
    row: int,
) -> int:
    """Fill shadows (row, ...) with those of episode b's obstacles (B, O); return how many.

    Even places of `obstacle` are of the catalogue's first side, odd ones of its second, -1 none.
    """
    count = 0
    for o in range(obstacle.shape[1]):
        if obstacle[b, o] >= 0:
            cast_shadow(catalogue, o % 2, obstacle[b, o], x, y, shadows, row, count)
            count += 1
    return count


@allocating_kernel
def _planes(shadows: Floats, b: int, o: int) -> Planes:
    """Return the four half-planes of shadow (b, o), so that they are read once for many points."""
    return (
        (shadows[b, o, 0, 0], shadows[b, o, 0, 1], shadows[b, o, 0, 2]),
        (shadows[b, o, 1, 0], shadows[b, o, 1, 1], shadows[b, o, 1, 2]),
        (shadows[b, o, 2, 0], shadows[b, o, 2, 1], shadows[b, o, 2, 2]),
        (shadows[b, o, 3, 0], shadows[b, o, 3, 1], shadows[b, o, 3, 2]),
    )


@kernel
def _sides(planes: Planes, x: float, y: float) -> tuple[float, float, float, float]:
    """Return how far inside of each half-plane of a shadow a point is, in lengths of the normal."""
    p, q, r, s = planes
    return (
        p[0] * x + p[1] * y - p[2],
        q[0] * x + q[1] * y - q[2],
        r[0] * x + r[1] * y - r[2],
        s[0] * x + s[1] * y - s[2],
    )


@allocating_kernel
def hide_points(
    x: Floats,
    y: Floats,
    sensor_x: float,
    sensor_y: float,
    range_m: float,
    shadows: Floats,
    b: int,
    count: int,
    depth: Floats,
) -> None:
    """Fill `depth` (N,) with more than 0 where points (N,) are out of range or in a shadow.

    The shadows are the first `count` of b in (B, O, 4, 3); their edges are still visible. All
    points at one shadow, and no branches, so that it runs in vector registers.
    """
    for i in range(len(x)):
        dx, dy = x[i] - sensor_x, y[i] - sensor_y
        depth[i] = 1.0 if dx * dx + dy * dy > range_m * range_m else -1.0
    for o in range(count):
        planes = _planes(shadows, b, o)
        for i in range(len(x)):
            inside = _sides(planes, x[i], y[i])
            within = min(inside[0], inside[1], inside[2], inside[3])
            depth[i] = max(depth[i], within)


@allocating_kernel
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
    """Tell of one point what `hide_points` tells of many."""
    one_x, one_y, depth = np.full(1, x), np.full(1, y), np.empty(1)
    hide_points(one_x, one_y, sensor_x, sensor_y, range_m, shadows, b, count, depth)
    return bool(depth[0] > 0.0)


@kernel
def range_exit(ax: float, ay: float, dx: float, dy: float, range_m: float) -> float:
    """Return the share of the way a + t d, relative to the sensor, at which it leaves the range.

    The way begins within range and ends beyond it.
    """
    square = dx * dx + dy * dy
    half = ax * dx + ay * dy
    start = ax * ax + ay * ay - range_m * range_m
    return (math.sqrt(half * half - square * start) - half) / square


@kernel
def narrowed(enter: float, leave: float, start: float, end: float) -> tuple[float, float]:
    """Narrow the shares of a way between which it lies in the half-planes seen so far."""
    share = start / (start - end)
    return (
        max(enter, share if end > start else 0.0),
        min(leave, share if end < start else 1.0),
    )


@allocating_kernel
def first_in_shadow(
    xy: Floats, p: int, points: int, shadows: Floats, b: int, o: int
) -> tuple[int, float]:
    """Return (segment, share) at which path p enters shadow o; (points, 0) if it never does.

    Cyrus and Beck 1978, segment by segment. A way that only touches the shadow does not enter it.
    """
    planes = _planes(shadows, b, o)
    a = _sides(planes, xy[p, 0, 0], xy[p, 0, 1])
    for k in range(1, points):
        z = _sides(planes, xy[p, k, 0], xy[p, k, 1])
        # Both ends outside of one half-plane: no point of the segment is in the shadow.
        apart = (max(a[0], z[0]) <= 0.0) | (max(a[1], z[1]) <= 0.0)
        apart |= (max(a[2], z[2]) <= 0.0) | (max(a[3], z[3]) <= 0.0)
        if not apart:
            enter, leave = narrowed(0.0, 1.0, a[0], z[0])
            enter, leave = narrowed(enter, leave, a[1], z[1])
            enter, leave = narrowed(enter, leave, a[2], z[2])
            enter, leave = narrowed(enter, leave, a[3], z[3])
            if enter < leave:
                return k - 1, enter
        a = z
    return points, 0.0


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
    segment, share = points, 0.0
    ax, ay = 0.0, 0.0
    for k in range(points):
        x, y = xy[p, k, 0] - sensor_x, xy[p, k, 1] - sensor_y
        if x * x + y * y > range_m * range_m:
            if k > 0:
                segment, share = k - 1, range_exit(ax, ay, x - ax, y - ay, range_m)
            else:
                segment = 0
            break
        ax, ay = x, y
    for o in range(count):
        # What is further than the nearest place found so far cannot change the result.
        found, at = first_in_shadow(xy, p, min(segment + 2, points), shadows, b, o)
        if found < segment or (found == segment and at < share):
            segment, share = found, at
    if segment == points:
        return range_m
    step = distance[p, segment + 1] - distance[p, segment]
    return float(distance[p, segment] + share * step)
