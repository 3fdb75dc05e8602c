# SPDX-License-Identifier: Apache-2.0
"""Chains of lanelets as one driving line with heights and widths."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.geometry.polyline import Polyline, arc_lengths
from risk_dqn_planner.geometry.smoothing import join, smooth
from risk_dqn_planner.map.loader import Lanelet, LineString

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LaneletChain:
    """Consecutive lanelets and the line along their middle.

    starts_m[k]: arc length at which lanelets[k] begins. height_m (K,): at the line's points.
    half_width_m: half the mean width of the narrowest lanelet.
    """

    lanelets: tuple[Lanelet, ...]
    starts_m: tuple[float, ...]
    centerline: Polyline
    height_m: Floats
    half_width_m: float

    @property
    def lanelet_ids(self) -> tuple[int, ...]:
        """Ids in driving direction."""
        return tuple(int(lanelet.id) for lanelet in self.lanelets)

    def end_m(self, index: int) -> float:
        """Return the arc length at which a lanelet ends."""
        if index + 1 < len(self.starts_m):
            return self.starts_m[index + 1]
        return self.centerline.length_m

    def height_at(self, s: float) -> float:
        """Return the height of the line at arc length s [m]."""
        return float(np.interp(s, self.centerline.s, self.height_m))


def chain(lanelets: Sequence[Lanelet]) -> LaneletChain:
    """Join the centrelines of consecutive lanelets into one smooth line."""
    drawn, first_points = join([_points(lanelet.centerline) for lanelet in lanelets])
    smoothed, drawn_at = smooth(drawn)
    line = Polyline.from_points(smoothed[:, :2])
    smoothed_s = arc_lengths(smoothed)
    starts = np.interp(arc_lengths(drawn)[first_points], drawn_at, smoothed_s)
    return LaneletChain(
        lanelets=tuple(lanelets),
        starts_m=tuple(float(start) for start in starts),
        centerline=line,
        height_m=np.interp(line.s, smoothed_s, smoothed[:, 2]),
        half_width_m=min(0.5 * mean_width_m(lanelet) for lanelet in lanelets),
    )


def mean_width_m(lanelet: Lanelet) -> float:
    """Return a lanelet's area over its length: no spike at an end that tapers or flares."""
    outline = np.vstack((_points(lanelet.leftBound), _points(lanelet.rightBound)[::-1]))
    x, y = outline[:, 0], outline[:, 1]
    area = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
    return area / max(float(arc_lengths(_points(lanelet.centerline))[-1]), 1e-3)


def _points(line: LineString) -> Floats:
    """Return the points (N, 3) of a lanelet2 linestring."""
    return np.array([(point.x, point.y, point.z) for point in line])
