# SPDX-License-Identifier: Apache-2.0
"""How far each lane is seen without a gap, upstream from its conflict zone (d_o of the paper).

The visible area is any simple polygon: neither convex nor star-shaped, in either orientation,
closed or open. A path is walked upstream and cut exactly where it meets the polygon's edges;
each piece between two cuts is seen or hidden as a whole.
"""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.geometry.polyline import segment_index_kernel
from risk_dqn_planner.situation.paths import PathTable

Floats = NDArray[np.float64]

# Relative to lengths of metres: cuts closer than this to a corner count as being at it.
_TOUCH = 1e-9


@kernel
def inside_kernel(polygon: Floats, x: float, y: float) -> bool:
    """Tell whether a point lies in a polygon (K, 2): a ray from it meets an odd number of edges."""
    inside = False
    j = polygon.shape[0] - 1
    for i in range(polygon.shape[0]):
        if (polygon[i, 1] > y) != (polygon[j, 1] > y):
            share = (y - polygon[i, 1]) / (polygon[j, 1] - polygon[i, 1])
            if x < polygon[i, 0] + share * (polygon[j, 0] - polygon[i, 0]):
                inside = not inside
        j = i
    return inside


@kernel
def cuts_kernel(polygon: Floats, ax: float, ay: float, bx: float, by: float, cuts: Floats) -> int:
    """Write the shares of the way from a to b at which a polygon's edges are met; return how many.

    cuts has room for 2 K shares. Touching counts; of an edge along the way both ends count.
    """
    rx, ry = bx - ax, by - ay
    length = math.hypot(rx, ry)
    count = 0
    j = polygon.shape[0] - 1
    # Signed distances of the corners from the line through a and b, and their shares along it.
    side_j = (rx * (polygon[j, 1] - ay) - ry * (polygon[j, 0] - ax)) / length
    for i in range(polygon.shape[0]):
        side_i = (rx * (polygon[i, 1] - ay) - ry * (polygon[i, 0] - ax)) / length
        apart = min(side_i, side_j) > _TOUCH or max(side_i, side_j) < -_TOUCH
        if not apart:
            share_i = _share(polygon, i, ax, ay, rx, ry, length)
            share_j = _share(polygon, j, ax, ay, rx, ry, length)
            if abs(side_i) <= _TOUCH and abs(side_j) <= _TOUCH:
                count = _add(cuts, count, share_i, length)
                count = _add(cuts, count, share_j, length)
            else:
                part = side_j / (side_j - side_i)
                count = _add(cuts, count, share_j + part * (share_i - share_j), length)
        j, side_j = i, side_i
    return count


@kernel
def _share(
    polygon: Floats, k: int, ax: float, ay: float, rx: float, ry: float, length: float
) -> float:
    ahead: float = rx * (polygon[k, 0] - ax) + ry * (polygon[k, 1] - ay)
    return ahead / (length * length)


@kernel
def _add(cuts: Floats, count: int, share: float, length: float) -> int:
    """Append a share if it lies on the way, and return the new count."""
    slack = _TOUCH / length
    if share < -slack or share > 1.0 + slack:
        return count
    cuts[count] = min(max(share, 0.0), 1.0)
    return count + 1


@kernel
def piece_kernel(
    xy: Floats, s: Floats, k: int, high: float, low: float
) -> tuple[float, float, float, float]:
    """Return both ends, ax, ay, bx, by, of the piece of segment k from arc length high to low.

    xy (K, 2) and s (K,) are the path; the piece runs upstream.
    """
    length = s[k + 1] - s[k]
    dx, dy = (xy[k + 1, 0] - xy[k, 0]) / length, (xy[k + 1, 1] - xy[k, 1]) / length
    return (
        xy[k, 0] + (high - s[k]) * dx,
        xy[k, 1] + (high - s[k]) * dy,
        xy[k, 0] + (low - s[k]) * dx,
        xy[k, 1] + (low - s[k]) * dy,
    )


@allocating_kernel
def first_hidden_kernel(xy: Floats, s: Floats, start: float, end: float, polygon: Floats) -> float:
    """Return the first arc length not in the polygon, going upstream from `start` to `end`.

    xy (K, 2) and s (K,) are the path, end <= start within it. `end` if all of it is seen.
    """
    cuts: Floats = np.empty(2 * polygon.shape[0] + 1)
    tested = False
    k = segment_index_kernel(s, start)
    while k >= 0 and s[k + 1] > end:
        high, low = min(start, s[k + 1]), max(end, s[k])
        if high > low:
            ax, ay, bx, by = piece_kernel(xy, s, k, high, low)
            count = cuts_kernel(polygon, ax, ay, bx, by, cuts)
            # Without a cut a piece is seen if the one before it was.
            if count > 0 or not tested:
                cuts[count] = 1.0
                hidden = _first_hidden_piece(polygon, ax, ay, bx, by, np.sort(cuts[: count + 1]))
                if hidden < 1.0:
                    place: float = high - hidden * (high - low)
                    return place
                tested = True
        k -= 1
    return end


@kernel
def _first_hidden_piece(
    polygon: Floats, ax: float, ay: float, bx: float, by: float, cuts: Floats
) -> float:
    """Return the share of the way from a to b where the first hidden piece begins, 1 if none."""
    begin = 0.0
    for cut in cuts:
        if cut - begin > _TOUCH:
            middle = 0.5 * (begin + cut)
            if not inside_kernel(polygon, ax + middle * (bx - ax), ay + middle * (by - ay)):
                return begin
            begin = cut
    return 1.0


@allocating_kernel
def hidden_distances_kernel(
    table: PathTable, lanes: int, polygon: Floats, sensor_range: float
) -> Floats:
    """Return d_o (M,): each zone's centre to the nearest place where a vehicle may hide [m].

    The least over a lane's upstream branches, at most `sensor_range`, also where a branch that is
    seen to its start is shorter: the map knows of no lane that leads into it. Minus half the
    zone's length where not even the zone's exit is seen.
    """
    nearest = np.full(lanes, math.inf)
    for p in range(table.lane.shape[0]):
        begin, stop = table.first[p], table.first[p + 1]
        s = table.s[begin:stop]
        center, lane = table.zone_center_m[p], table.lane[p]
        start = min(center + 0.5 * table.zone_m[p], s[-1])
        # What is further than the nearest place found so far cannot change the result.
        end = min(max(center - min(sensor_range, nearest[lane]), 0.0), start)
        hidden = first_hidden_kernel(table.xy[begin:stop], s, start, end, polygon)
        seen = sensor_range if hidden <= end else center - hidden
        nearest[lane] = min(nearest[lane], seen)
    return nearest
