# SPDX-License-Identifier: Apache-2.0
"""Which intersecting lanes a vehicle on a simulated path is matched to, and how far along them.

The planner matches perceived vehicles by their pose. Paths are fixed, so its own matching is
asked once for every place along every path, and the answers are kept as pieces in which the
distance changes linearly. So batches see what the situation node would see, at a fraction of
the cost.
"""

import itertools
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.matching import NOT_ON_PATH, distance_on_path_kernel
from risk_dqn_planner.situation.paths import PathTable, path_table
from risk_dqn_planner.situation.situations import Floats, Integers
from sim_bridge.path_geometry import simplified, table_pose

_SAMPLE_M = 0.1
# A piece is straight enough if it is off by less than this, in metres and in shares of speed.
_TOLERANCE = 0.005


class Matches(NamedTuple):
    """The pieces of path p are those from first[p] to first[p + 1] (exclusive), of C in all.

    lane (C,): index into the M lanes. low_m and high_m (C,): the piece, in arc length of the path.
    distance_m (C,): to the zone's centre at low_m; change (C,): of the distance with arc length.
    share (C,): of the speed that is along the lane, at low_m; share_change (C,) [1/m].
    """

    first: Integers
    lane: Integers
    low_m: Floats
    high_m: Floats
    distance_m: Floats
    change: Floats
    share: Floats
    share_change: Floats


@kernel
def _lane_along(
    table: PathTable, lanes: int, poses: Floats, tolerance: float, turn: float
) -> tuple[Floats, Floats]:
    """Return (distance, share of speed) of each pose (A, 3) on each lane (A, M)."""
    distance = np.full((len(poses), lanes), NOT_ON_PATH)
    share = np.ones((len(poses), lanes))
    for a in range(len(poses)):
        for q in range(len(table.lane)):
            d, along = distance_on_path_kernel(
                table, q, poses[a, 0], poses[a, 1], poses[a, 2], tolerance, turn
            )
            if d < distance[a, table.lane[q]]:
                distance[a, table.lane[q]] = d
                share[a, table.lane[q]] = np.cos(poses[a, 2] - along)
    return distance, share


def match_table(
    model: IntersectionModel,
    tables: Floats,
    lengths: Floats,
    config: SituationConfig | None = None,
) -> Matches:
    """Match every place along the sampled paths (P, K, 3) of the given lengths (P,)."""
    config = config or SituationConfig()
    planner_paths = path_table(model)
    rows: list[list[tuple[float, ...]]] = []
    for p, length in enumerate(lengths):
        at = np.arange(0.0, length + _SAMPLE_M, _SAMPLE_M)
        poses = np.array([table_pose(tables, p, s) for s in at])
        distance, share = _lane_along(
            planner_paths,
            len(model.lanes),
            poses,
            config.lateral_tolerance_m,
            config.max_heading_difference_rad,
        )
        pieces = [
            (lane, *piece)
            for lane in range(len(model.lanes))
            for piece in _pieces(at, distance[:, lane], share[:, lane])
        ]
        rows.append(sorted(pieces, key=lambda piece: (piece[0], piece[1])))
    flat = np.array([piece for row in rows for piece in row], dtype=np.float64).reshape(-1, 7)
    first = np.cumsum([0] + [len(row) for row in rows], dtype=np.int64)
    columns = [np.ascontiguousarray(flat[:, k]) for k in range(1, 7)]
    return Matches(first, flat[:, 0].astype(np.int64), *columns)


def _pieces(at: Floats, distance: Floats, share: Floats) -> list[tuple[float, ...]]:
    """Cut where a lane is matched into straight pieces; see `Matches` for their numbers."""
    matched = distance < NOT_ON_PATH
    edges = np.flatnonzero(np.diff(np.concatenate(([0], matched.astype(int), [0]))))
    pieces = []
    for begin, end in edges.reshape(-1, 2):
        # A jump is where another way through the lane takes over.
        jumps = begin + 1 + np.flatnonzero(np.abs(np.diff(distance[begin:end])) > 3.0 * _SAMPLE_M)
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
        high = at[b] + (_SAMPLE_M * 0.5 if b == len(at) - 1 else 0.0)
        low = at[a] - (_SAMPLE_M * 0.5 if a == 0 else 0.0)
        change = (distance[b] - distance[a]) / run
        share_change = (share[b] - share[a]) / run
        offset = low - at[a]
        pieces.append(
            (
                low,
                high,
                distance[a] + offset * change,
                change,
                share[a] + offset * share_change,
                share_change,
            )
        )
    return pieces
