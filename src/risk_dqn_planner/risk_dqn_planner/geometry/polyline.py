# SPDX-License-Identifier: Apache-2.0
"""Polylines parameterised by arc length s: where a point lies along a lane, and back.

Both directions extend the first and the last segment straight on, so that a vehicle short of
a path's start has a negative s and one past its end an s beyond the length.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.errors import MapError

Floats = NDArray[np.float64]

# Closer points than this are one point: segments need a direction that rounding cannot turn.
MIN_POINT_SPACING_M = 1e-6


def arc_lengths(points: Floats) -> Floats:
    """Return the arc length (N,) in the plane at each of the points (N, 2) or (N, 3) [m]."""
    step = np.diff(points[:, :2], axis=0)
    return np.concatenate(([0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))))


@kernel
def segment_index_kernel(s: Floats, at: float) -> int:
    """Return the segment that holds arc length `at`; the first or the last one beyond the ends."""
    low = 0
    high = s.shape[0] - 2
    while low < high:
        middle = (low + high + 1) // 2
        if s[middle] <= at:
            low = middle
        else:
            high = middle - 1
    return low


@kernel
def pose_kernel(xy: Floats, s: Floats, at: float) -> tuple[float, float, float]:
    """Return (x, y, heading) at arc length `at` of a polyline with xy (K, 2) and s (K,)."""
    k = segment_index_kernel(s, at)
    dx = xy[k + 1, 0] - xy[k, 0]
    dy = xy[k + 1, 1] - xy[k, 1]
    share = (at - s[k]) / (s[k + 1] - s[k])
    return xy[k, 0] + share * dx, xy[k, 1] + share * dy, math.atan2(dy, dx)


@kernel
def project_kernel(
    xy: Floats,
    s: Floats,
    x: float,
    y: float,
    heading: float = math.nan,
    max_heading_difference: float = math.pi,
) -> tuple[float, float, float]:
    """Return (s, lateral, heading) of the nearest point of a polyline with xy (K, 2), s (K,).

    With a heading [rad], the nearest segment among those that differ from it by no more than
    `max_heading_difference` is taken, because a path may pass the same place twice (loops) or
    be crossed by itself; if none qualifies, or for a NaN heading, the nearest of all.
    Lateral is positive to the left [m]; the returned heading is that of the segment.
    """
    any_heading = math.isnan(heading)
    cos_heading = 1.0 if any_heading else math.cos(heading)
    sin_heading = 0.0 if any_heading else math.sin(heading)
    least_cosine = -2.0 if any_heading else math.cos(min(max_heading_difference, math.pi))
    best = -1
    best_square = math.inf
    best_fits = False
    last = xy.shape[0] - 2
    for k in range(last + 1):
        dx = xy[k + 1, 0] - xy[k, 0]
        dy = xy[k + 1, 1] - xy[k, 1]
        length = s[k + 1] - s[k]
        fits = cos_heading * dx + sin_heading * dy >= (least_cosine - 1e-12) * length
        if best_fits and not fits:
            continue
        px = x - xy[k, 0]
        py = y - xy[k, 1]
        share = min(max((px * dx + py * dy) / (length * length), 0.0), 1.0)
        square = (px - share * dx) ** 2 + (py - share * dy) ** 2
        if square < best_square or (fits and not best_fits):
            best, best_square, best_fits = k, square, fits
    dx = xy[best + 1, 0] - xy[best, 0]
    dy = xy[best + 1, 1] - xy[best, 1]
    length = s[best + 1] - s[best]
    px = x - xy[best, 0]
    py = y - xy[best, 1]
    along = (px * dx + py * dy) / length
    lateral = (dx * py - dy * px) / length
    beyond_start = best == 0 and along < 0.0
    beyond_end = best == last and along > length
    if not beyond_start and not beyond_end and (along < 0.0 or along > length):
        # The outside of a corner: the nearest point is the corner, not a foot on the segment.
        along = min(max(along, 0.0), length)
        lateral = math.copysign(math.sqrt(best_square), lateral)
    return s[best] + along, lateral, math.atan2(dy, dx)


class Projection(NamedTuple):
    """A point relative to a polyline: arc length, offset (left positive), segment heading."""

    s: float
    lateral_m: float
    heading_rad: float


@dataclass(frozen=True, eq=False)
class Polyline:
    """Points in the map frame with their arc lengths, in driving direction.

    xy (K, 2) [m]; s (K,) arc length from the first point [m]; heading (K-1,) of the segments
    [rad], counter-clockwise from the x axis. K >= 2, no two consecutive points coincide.
    """

    xy: Floats
    s: Floats
    heading: Floats

    @classmethod
    def from_points(cls, points: ArrayLike) -> "Polyline":
        """Build from points (N, 2), dropping repeated ones.

        Raises:
            MapError: fewer than two distinct points, or one that is not finite.
        """
        given = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        if not np.isfinite(given).all():
            raise MapError("a polyline has a point that is not finite")
        kept: list[int] = []
        for index, point in enumerate(given):
            if not kept or math.dist(point, given[kept[-1]]) > MIN_POINT_SPACING_M:
                kept.append(index)
        if len(kept) < 2:
            raise MapError(f"a polyline needs two distinct points, got {len(kept)}")
        xy = np.ascontiguousarray(given[kept])
        step = np.diff(xy, axis=0)
        return cls(xy, arc_lengths(xy), np.arctan2(step[:, 1], step[:, 0]))

    @property
    def length_m(self) -> float:
        """Arc length of the last point."""
        return float(self.s[-1])

    def position(self, s: float) -> tuple[float, float]:
        """Return the point at arc length s, straight on beyond both ends."""
        x, y, _ = pose_kernel(self.xy, self.s, float(s))
        return x, y

    def heading_at(self, s: float) -> float:
        """Return the heading of the segment at arc length s [rad]."""
        return float(self.heading[segment_index_kernel(self.s, float(s))])

    def crossings(self, other: "Polyline") -> Floats:
        """Return the arc lengths (N,) of this line at which the other one crosses it, sorted."""
        start, step = self.xy[:-1, None, :], np.diff(self.xy, axis=0)[:, None, :]
        other_start, other_step = other.xy[None, :-1, :], np.diff(other.xy, axis=0)[None, :, :]
        apart = other_start - start
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = _cross(step, other_step)
            share = _cross(apart, other_step) / turn
            other_share = _cross(apart, step) / turn
        hit = (share >= 0) & (share < 1) & (other_share >= 0) & (other_share <= 1)
        rows, columns = np.nonzero(hit)
        return np.sort(self.s[rows] + share[rows, columns] * np.diff(self.s)[rows])

    def project(
        self,
        x: float,
        y: float,
        heading: float = math.nan,
        max_heading_difference: float = math.pi,
    ) -> Projection:
        """Return the nearest point's place on the line, see `project_kernel`."""
        return Projection(
            *project_kernel(
                self.xy,
                self.s,
                float(x),
                float(y),
                float(heading),
                float(max_heading_difference),
            )
        )


def _cross(first: Floats, second: Floats) -> Floats:
    """Return the cross product (...) of plane vectors (..., 2)."""
    product: Floats = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return product
