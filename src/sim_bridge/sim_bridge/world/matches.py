# SPDX-License-Identifier: Apache-2.0
"""Which intersecting lanes a vehicle on a simulated path is matched to, and how far along them.

The planner matches perceived vehicles by their pose. Paths are fixed, so its own matching is
asked once for every place along every path, and the answers are kept as pieces in which the
distance changes linearly. So batches see what the situation node would see, at a fraction of
the cost.
"""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.matching import NOT_ON_PATH, distance_on_path_kernel
from risk_dqn_planner.situation.paths import PathTable, path_table
from risk_dqn_planner.situation.situations import Floats, Integers
from sim_bridge.world.path_geometry import simplified, table_pose

_SAMPLE_M = 0.1
_FINEST_M = 1e-3
# Distances along two lanes change about as fast as arc length, but for jumps.
_JUMP = 3.0
# Vehicles are replaced at the next decision, at most so many metres beyond the end of their path.
_CELLS_BEYOND = 20
# A piece is straight enough if it is off by less than this, in metres and in shares of speed.
_TOLERANCE = 0.005


class Matches(NamedTuple):
    """C pieces, and which of them may hold at a place.

    Those for the arc lengths k to k + 1 [m] of path p are piece[first[p, k]] to
    piece[first[p, k + 1]] (exclusive), in the order of their lanes; first (P, K + 1), piece (E,).
    lane (C,): index into the M lanes. low_m and high_m (C,): the piece, in arc length of its path.
    distance_m (C,): to the zone's centre at low_m; change (C,): of the distance with arc length.
    share (C,): of the speed that is along the lane, at low_m; share_change (C,) [1/m].
    """

    first: Integers
    piece: Integers
    lane: Integers
    low_m: Floats
    high_m: Floats
    distance_m: Floats
    change: Floats
    share: Floats
    share_change: Floats


@allocating_kernel
def _lane_along(
    table: PathTable, lanes: int, poses: Floats, tolerance: float, turn: float
) -> tuple[Floats, Floats]:
    """Return (distance, share of speed) of each pose (A, 3) on each lane (A, M)."""
    distance = np.full((len(poses), lanes), NOT_ON_PATH)
    share = np.ones((len(poses), lanes))
    for a in range(len(poses)):
        for q in range(len(table.lane)):
            d, along = distance_on_path_kernel(
                table, q, poses[a, 0], poses[a, 1], poses[a, 2], tolerance, turn, 0.0
            )
            if d < distance[a, table.lane[q]]:
                distance[a, table.lane[q]] = d
                share[a, table.lane[q]] = np.cos(poses[a, 2] - along)
    return distance, share


def most_lanes_at_once(matches: Matches) -> int:
    """Return how many lanes a vehicle may be matched to at one place."""
    lanes = matches.lane[matches.piece]
    bounds = matches.first.ravel()
    return max(
        (len(set(lanes[begin:end])) for begin, end in itertools.pairwise(bounds) if end > begin),
        default=0,
    )


def match_table(
    model: IntersectionModel,
    tables: Floats,
    lengths: Floats,
    config: SituationConfig | None = None,
) -> Matches:
    """Match every place along the sampled paths (P, K, 3) of the given lengths (P,)."""
    config = config or SituationConfig()
    planner_paths = path_table(model)
    lanes = len(model.lanes)

    def lanes_at(path: int, at: Floats) -> tuple[Floats, Floats]:
        poses = np.array([table_pose(tables, path, s) for s in at]).reshape(-1, 3)
        tolerance, turn = config.lateral_tolerance_m, config.max_heading_difference_rad
        return _lane_along(planner_paths, lanes, poses, tolerance, turn)

    rows = []
    for p, length in enumerate(lengths):
        at, distance, share = _refined(p, float(length), lanes_at)
        rows.append(
            [
                (lane, *piece)
                for lane in range(lanes)
                for piece in _pieces(at, distance[:, lane], share[:, lane])
            ]
        )
    cells = int(max(lengths)) + _CELLS_BEYOND
    first, piece = _cells(rows, cells)
    flat = np.array([piece for row in rows for piece in row], dtype=np.float64).reshape(-1, 7)
    columns = [np.ascontiguousarray(flat[:, k]) for k in range(1, 7)]
    return Matches(first, piece, flat[:, 0].astype(np.int64), *columns)


def _cells(rows: list[list[tuple[float, ...]]], cells: int) -> tuple[Integers, Integers]:
    """Return `first` and `piece` of `Matches` for the pieces (lane, low_m, high_m, ...) of paths.

    Beyond the last cell, where vehicles wait for their replacement, nothing is matched.
    """
    first: list[int] = []
    piece: list[int] = []
    before = 0
    for row in rows:
        for cell in range(cells):
            first.append(len(piece))
            piece += [
                before + k
                for k, (_, low, high, *_) in enumerate(row)
                if low < cell + 1 and high > cell
            ]
        first.append(len(piece))
        before += len(row)
    return (
        np.array(first, dtype=np.int64).reshape(len(rows), cells + 1),
        np.array(piece, dtype=np.int64),
    )


def _refined(
    path: int, length_m: float, lanes_at: Callable[[int, Floats], tuple[Floats, Floats]]
) -> tuple[Floats, Floats, Floats]:
    """Return places (A,) along a path, dense where the matching jumps, with `_lane_along`'s answer.

    Jumps are where a lane begins or ends to match, or where the nearest segment changes.
    """
    at = np.append(np.arange(0.0, length_m, _SAMPLE_M), length_m)
    distance, share = lanes_at(path, at)
    while True:
        matched = distance < NOT_ON_PATH
        apart = np.abs(np.diff(np.where(matched, distance, 0.0), axis=0))
        jumps = matched[1:] != matched[:-1]
        jumps |= apart > _JUMP * np.diff(at)[:, None]
        jumps |= np.abs(np.diff(share, axis=0)) > _TOLERANCE
        where = np.flatnonzero(jumps.any(axis=1) & (np.diff(at) > _FINEST_M))
        if len(where) == 0:
            return at, distance, share
        more = 0.5 * (at[where] + at[where + 1])
        more_distance, more_share = lanes_at(path, more)
        at = np.insert(at, where + 1, more)
        distance = np.insert(distance, where + 1, more_distance, axis=0)
        share = np.insert(share, where + 1, more_share, axis=0)


def _pieces(at: Floats, distance: Floats, share: Floats) -> list[tuple[float, ...]]:
    """Cut where a lane is matched into straight pieces; see `Matches` for their numbers."""
    matched = distance < NOT_ON_PATH
    edges = np.flatnonzero(np.diff(np.concatenate(([0], matched.astype(int), [0]))))
    pieces = []
    for begin, end in edges.reshape(-1, 2):
        # A jump is where another way through the lane takes over.
        apart = np.abs(np.diff(distance[begin:end]))
        jumps = begin + 1 + np.flatnonzero(apart > _JUMP * np.diff(at[begin:end]))
        for low, high in zip([begin, *jumps], [*jumps, end], strict=True):
            run = slice(low, high)
            pieces += _straight_pieces(at[run], distance[run], share[run])
    return pieces


def _straight_pieces(at: Floats, distance: Floats, share: Floats) -> list[tuple[float, ...]]:
    # Both curves at once: arc length is the first axis of two lines that share their corners.
    corners = sorted(
        set(simplified(np.column_stack((at, distance)), _TOLERANCE))
        | set(simplified(np.column_stack((at, share)), _TOLERANCE))
    )
    pieces: list[tuple[float, ...]] = []
    for a, b in itertools.pairwise(corners):
        run = at[b] - at[a]
        change = (distance[b] - distance[a]) / run
        share_change = (share[b] - share[a]) / run
        # The last piece also has the rest, less than the finest step, to where the lane ends.
        high = at[b] + (_FINEST_M if b == len(at) - 1 else 0.0)
        pieces.append((at[a], high, distance[a], change, share[a], share_change))
    return pieces
