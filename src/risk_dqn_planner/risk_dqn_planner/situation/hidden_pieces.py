# SPDX-License-Identifier: Apache-2.0
"""All hidden pieces of a path, where `occlusion` asks for the nearest one only."""

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel
from risk_dqn_planner.geometry.polyline import segment_index_kernel
from risk_dqn_planner.situation.intervals import insert
from risk_dqn_planner.situation.occlusion import cuts_kernel, inside_kernel, piece_kernel
from risk_dqn_planner.situation.paths import PathTable
from risk_dqn_planner.situation.situations import Floats


def looked_at(table: PathTable, sensor_range_m: float) -> tuple[Floats, Floats]:
    """Return the distances (P,) between which paths are looked at: the zone's exit and the end.

    The end is the sensor's range, or where the map's lanes begin if that is nearer.
    """
    center = table.zone_center_m
    exit_m = center - np.minimum(center + 0.5 * table.zone_m, table.s[table.first[1:] - 1])
    return exit_m, np.maximum(np.minimum(sensor_range_m, center), exit_m)


@allocating_kernel
def hidden_pieces_kernel(
    table: PathTable,
    p: int,
    polygon: Floats,
    exit_m: float,
    end_m: float,
    margin_m: float,
    near: Floats,
    far: Floats,
) -> int:
    """Write what a polygon (K, 2) does not show of path p as a set of distances; see `intervals`.

    From exit_m to end_m to the zone's centre, in row p of near and far; returns how many
    intervals. What is nearer than margin_m to a hidden place along the path counts as hidden.
    """
    cuts: Floats = np.empty(2 * polygon.shape[0] + 1)
    first, center = table.first[p], table.zone_center_m[p]
    xy, s = table.xy[first : table.first[p + 1]], table.s[first : table.first[p + 1]]
    start, end = center - exit_m, center - end_m
    count, known, seen = 0, False, False
    k = segment_index_kernel(s, start)
    while k >= 0 and s[k + 1] > end:
        high, low = min(start, s[k + 1]), max(end, s[k])
        if high > low:
            ax, ay, bx, by = piece_kernel(xy, s, k, high, low)
            met = cuts_kernel(polygon, ax, ay, bx, by, cuts)
            cuts[met] = 1.0
            begin = 0.0
            for cut in np.sort(cuts[: met + 1]):
                # Without a cut a piece is seen if the one before it was.
                if met > 0 or not known:
                    middle = 0.5 * (begin + cut)
                    seen = inside_kernel(polygon, ax + middle * (bx - ax), ay + middle * (by - ay))
                    known = True
                if not seen and cut > begin:
                    nearest = center - high + begin * (high - low) - margin_m
                    furthest = center - high + cut * (high - low) + margin_m
                    count = insert(near, far, p, count, max(nearest, exit_m), min(furthest, end_m))
                begin = cut
        k -= 1
    return count
