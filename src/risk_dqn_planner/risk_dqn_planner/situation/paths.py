# SPDX-License-Identifier: Apache-2.0
"""The conflict paths of a model as flat arrays, the form in which compiled code walks them."""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.intersection.model import (
    ConflictKind,
    ConflictPath,
    IntersectingLane,
    IntersectionModel,
)
from risk_dqn_planner.situation.situations import Floats, Integers


class PathTable(NamedTuple):
    """P conflict paths of M lanes; path p owns the points first[p] to first[p + 1] (exclusive).

    xy (K, 2) and s (K,): centrelines and their arc lengths [m]. first (P + 1,).
    lane (P,): index into the M lanes, not decreasing. zone_center_m (P,); zone_m (P,).
    end_m (P,): arc length up to which vehicles matter. half_width_m (P,).
    box (P, 4): least x, least y, greatest x, greatest y of the centreline.
    """

    xy: Floats
    s: Floats
    first: Integers
    lane: Integers
    zone_center_m: Floats
    zone_m: Floats
    end_m: Floats
    half_width_m: Floats
    box: Floats


def path_table(model: IntersectionModel) -> PathTable:
    """Flatten the paths of all lanes, in the model's order."""
    pairs = [(index, lane, path) for index, lane in enumerate(model.lanes) for path in lane.paths]
    lines = [path.path.centerline for _, _, path in pairs]
    counts = [0] + [len(line.s) for line in lines]
    boxes = [(*line.xy.min(axis=0), *line.xy.max(axis=0)) for line in lines]
    return PathTable(
        xy=np.concatenate([line.xy for line in lines]),
        s=np.concatenate([line.s for line in lines]),
        first=np.cumsum(counts, dtype=np.int64),
        lane=np.array([index for index, _, _ in pairs], dtype=np.int64),
        zone_center_m=np.array([path.zone_center_m for _, _, path in pairs]),
        zone_m=np.array([lane.zone_length_m for _, lane, _ in pairs]),
        end_m=np.array([_relevant_until(model, lane, path) for _, lane, path in pairs]),
        half_width_m=np.array([path.path.half_width_m for _, _, path in pairs]),
        box=np.array(boxes, dtype=np.float64),
    )


def _relevant_until(
    model: IntersectionModel, lane: IntersectingLane, conflict: ConflictPath
) -> float:
    """Return the arc length on a path behind which vehicles do not matter any more.

    A crossing vehicle matters until it has left the zone. One that has merged is the ego's
    leader from then on, and matters past the ego's goal as well, or the ego would run into one
    that comes to rest there.
    """
    end = conflict.zone_center_m + 0.5 * lane.zone_length_m
    if lane.kind == ConflictKind.MERGING:
        end = max(end, conflict.join_m + model.leaders_until_m - lane.ego_join_m)
    return min(end, conflict.path.centerline.length_m)
