# SPDX-License-Identifier: Apache-2.0
"""The paths as the sensor looks along them: from the zone's exit upstream, few points each."""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.situation.situations import Floats, Integers
from sim_bridge.world.path_geometry import simplified

_TOLERANCE_M = 0.05


class SightLines(NamedTuple):
    """The P paths in the model's order of lanes and their paths.

    xy (P, V, 2): points from the zone's exit upstream to the path's start or the sensor range;
    distance_m (P, V): of each point to the zone's centre; points (P,): how many there are.
    """

    points: Integers
    xy: Floats
    distance_m: Floats


def sight_lines(model: IntersectionModel, sensor_range_m: float) -> SightLines:
    """Simplify all paths of a model, in its order of lanes and paths."""
    lines = [
        _upstream(path.path.centerline, path.zone_center_m, lane.zone_length_m, sensor_range_m)
        for lane in model.lanes
        for path in lane.paths
    ]
    most = max(len(xy) for xy, _ in lines)
    result = SightLines(
        np.array([len(xy) for xy, _ in lines], dtype=np.int64),
        np.zeros((len(lines), most, 2)),
        np.zeros((len(lines), most)),
    )
    for p, (xy, distance) in enumerate(lines):
        result.xy[p, : len(xy)] = xy
        result.distance_m[p, : len(xy)] = distance
    return result


def _upstream(
    line: Polyline, center_m: float, zone_m: float, sensor_range_m: float
) -> tuple[Floats, Floats]:
    """Return points and their distances, the nearest to the zone's exit first."""
    begin = min(center_m + 0.5 * zone_m, line.length_m)
    end = min(max(center_m - sensor_range_m, 0.0), begin)
    between = line.s[(line.s > end) & (line.s < begin)]
    s = np.concatenate(([begin], between[::-1], [end]))
    xy = np.array([line.position(at) for at in s])
    kept = simplified(xy, _TOLERANCE_M)
    return xy[kept], center_m - s[kept]
