# SPDX-License-Identifier: Apache-2.0
"""The paths as the memory watches them, and how far vehicles may be beside its lines."""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.situation.situations import Floats, Integers
from sim_bridge.world.path_geometry import SPACING_M, table_pose
from sim_bridge.world.sight_lines import SightLines
from sim_bridge.world.world import Paths

# Of coordinates of some hundred metres.
_ROUNDING_M = 1e-6


class WatchedLines(NamedTuple):
    """The P paths in the model's order of lanes and their paths, as in `SightLines`.

    exit_m, end_m (P,): distances of the first and the last of their points. lane (P,): index into
    the M lanes. slack_m (P, V - 1): on segment k of the sight line a vehicle is at most so far from
    the point that has its distance. fastest_mps (M,): of hidden vehicles.
    """

    points: Integers
    xy: Floats
    distance_m: Floats
    exit_m: Floats
    end_m: Floats
    lane: Integers
    slack_m: Floats
    fastest_mps: Floats


def watched_lines(sight: SightLines, paths: Paths, fastest_mps: Floats) -> WatchedLines:
    """Relate sight lines (P) to the lines on which vehicles drive; fastest_mps (M,)."""
    return WatchedLines(
        points=sight.points,
        xy=sight.xy,
        distance_m=sight.distance_m,
        exit_m=np.ascontiguousarray(sight.distance_m[:, 0]),
        end_m=sight.distance_m[np.arange(len(sight.points)), sight.points - 1],
        lane=paths.lane,
        slack_m=np.array([_slack(sight, paths, p) for p in range(len(paths.lane))]),
        fastest_mps=fastest_mps,
    )


def _slack(sight: SightLines, paths: Paths, p: int) -> Floats:
    """Return how far vehicles on path p are from where the sight line has their distance (V - 1,).

    Both lines are straight between their points, so that the greatest distance on each segment is
    at one of them.
    """
    count = sight.points[p]
    distance, xy = sight.distance_m[p, :count], sight.xy[p, :count]
    on_table = paths.zone_m[p] - SPACING_M * np.arange(paths.table.shape[1])
    inside = on_table[(on_table > distance[0]) & (on_table < distance[-1])]
    at = np.sort(np.concatenate((distance, inside)))
    on_line = np.column_stack([np.interp(at, distance, xy[:, axis]) for axis in range(2)])
    driven = np.array([table_pose(paths.table, p, paths.zone_m[p] - d)[:2] for d in at])
    away = np.hypot(*(driven - on_line).T) + _ROUNDING_M
    slack = np.zeros(sight.xy.shape[1] - 1)
    for k in range(count - 1):
        slack[k] = away[(at >= distance[k]) & (at <= distance[k + 1])].max()
    return slack
