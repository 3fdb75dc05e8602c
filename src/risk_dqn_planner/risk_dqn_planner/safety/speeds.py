# SPDX-License-Identifier: Apache-2.0
"""Bounds on the speeds of others, tighter than the error of one measurement (docs/safety.md).

Who is seen at successive decisions has covered a way in between, and speeds change no faster than
the assumptions say. All bounds that follow hold at once, so the truth lies in what they share.
"""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.safety.assumptions import SafetyAssumptions, SafetyNumbers
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations

# Places along lanes may be off by so much more, where vehicles are matched to them.
_MATCHING_M = 0.2


class Speeds(NamedTuple):
    """Speeds along their lanes, all (B, N): the truth is in [low, high], likely where it may be."""

    low_mps: Floats
    high_mps: Floats
    likely_mps: Floats


class _Seen(NamedTuple):
    """What was seen at the decision before, (B, N)."""

    mask: Booleans
    id: Integers
    lane: Integers
    distance_m: Floats
    high_mps: Floats


class SpeedBounds:
    """Remembers, row by row, who was where at the decision before, and how fast at most."""

    def __init__(self, assumptions: SafetyAssumptions) -> None:
        self._numbers = assumptions.numbers()
        self._seen = _nobody(0)

    def look(self, situations: Situations, restart: Booleans) -> Speeds:
        """Return bounds after another look; to be called once for each decision."""
        p, s = self._numbers, situations
        speeds = measured(s, p)
        if p.speed_error_mps <= 0.0:
            return speeds
        if len(self._seen.mask) != len(restart):
            self._seen = _nobody(len(restart))
        tighten(s, restart, p, *self._seen, *speeds)
        self._seen = _Seen(
            s.vehicle_mask.copy(),
            s.vehicle_id.copy(),
            s.vehicle_lane.copy(),
            s.vehicle_distance_m.copy(),
            speeds.high_mps,
        )
        return speeds

    def keep(self, rows: Integers) -> None:
        """Go on with other rows (B,) of the batch in place of the present ones."""
        if len(self._seen.mask):
            self._seen = _Seen._make(part[rows] for part in self._seen)


def _nobody(batch: int) -> _Seen:
    whole = np.empty((batch, 0), dtype=np.int64)
    floats = np.empty((batch, 0))
    return _Seen(np.empty((batch, 0), dtype=np.bool_), whole, whole, floats, floats)


def measured(s: Situations, p: SafetyNumbers) -> Speeds:
    """Return what one measurement tells; nobody drives backwards."""
    mps, error_mps = s.vehicle_speed_mps, p.speed_error_mps
    return Speeds(
        np.maximum(mps - error_mps, 0.0), np.maximum(mps + error_mps, 0.0), np.maximum(mps, 0.0)
    )


@allocating_kernel
def tighten(
    s: Situations,
    restart: Booleans,
    p: SafetyNumbers,
    was_there: Booleans,
    was_id: Integers,
    was_lane: Integers,
    was_m: Floats,
    was_high_mps: Floats,
    low_mps: Floats,
    high_mps: Floats,
    likely_mps: Floats,
) -> None:
    """Lower the upper bounds (B, N) of what was measured by what was seen before (B, N')."""
    mask, lanes = s.vehicle_mask, s.vehicle_lane
    batch, count = mask.shape
    timed = p.period_error_s < p.period_s
    longest_s = p.period_s + p.period_error_s
    way_m, before_mps = np.empty(count), np.empty(count)
    for row in range(batch):
        way_m[:] = -math.inf
        if timed and not restart[row]:
            note_ways(s, row, was_there, was_id, was_lane, was_m, was_high_mps, way_m, before_mps)
        for i in range(count):
            if not mask[row, i]:
                continue
            low, high = low_mps[row, i], high_mps[row, i]
            limit_mps = s.lane_speed_limit_mps[row, lanes[row, i]] * p.limit_factor
            # Who is measured to drive above the limit for certain keeps to no limit.
            if low <= limit_mps:
                high = min(high, limit_mps)
            if way_m[i] > -math.inf:
                furthest_m = furthest(s, row, i, way_m)
                most = highest_after(furthest_m, p)
                most = min(most, before_mps[i] + p.others_up_mps2 * longest_s, high)
                # Bounds that contradict each other say that it was matched to another way.
                if low <= most:
                    high, likely_mps[row, i] = most, furthest_m / p.period_s
            high_mps[row, i] = high
            likely_mps[row, i] = min(max(likely_mps[row, i], low), high)


@kernel
def note_ways(
    s: Situations,
    row: int,
    was_there: Booleans,
    was_id: Integers,
    was_lane: Integers,
    was_m: Floats,
    was_high_mps: Floats,
    way_m: Floats,
    before_mps: Floats,
) -> None:
    """Fill the ways (N,) of those who were seen before, and their bounds of then (N,)."""
    mask, ids, lanes = s.vehicle_mask, s.vehicle_id, s.vehicle_lane
    for i in range(mask.shape[1]):
        if not mask[row, i]:
            continue
        for k in range(was_there.shape[1]):
            same = was_there[row, k] and was_id[row, k] == ids[row, i]
            if same and was_lane[row, k] == lanes[row, i]:
                way_m[i] = was_m[row, k] - s.vehicle_distance_m[row, i]
                before_mps[i] = was_high_mps[row, k]


@kernel
def furthest(s: Situations, row: int, vehicle: int, way_m: Floats) -> float:
    """Return the furthest way that a vehicle covered on any lane that it is matched to.

    Beside a lane that it does not follow, ways are shorter, and shrink where another way through
    that lane becomes the nearest one.
    """
    furthest_m = way_m[vehicle]
    for i in range(len(way_m)):
        if s.vehicle_mask[row, i] and s.vehicle_id[row, i] == s.vehicle_id[row, vehicle]:
            furthest_m = max(furthest_m, way_m[i])
    return float(furthest_m)


@kernel
def highest_after(way_m: float, p: SafetyNumbers) -> float:
    """Return the highest speed after a decision period in which a way was covered.

    Of someone who sped up all the time, if need be from a standstill; the shorter the period, the
    faster. No speed is so low that the way would be below 0: minus infinity.
    """
    most_m = way_m + 2.0 * (p.position_error_m + _MATCHING_M)
    if most_m < 0.0:
        return -math.inf
    up, shortest_s = p.others_up_mps2, p.period_s - p.period_error_s
    if 2.0 * most_m >= up * shortest_s * shortest_s:
        return most_m / shortest_s + 0.5 * up * shortest_s
    return math.sqrt(2.0 * up * most_m)


@kernel
def error_ahead(p: SafetyNumbers) -> float:
    """Return by how much the upper bound of someone who keeps the speed will be above it."""
    if p.period_error_s >= p.period_s:
        return p.speed_error_mps
    error_m = 2.0 * (p.position_error_m + _MATCHING_M)
    return min(error_m / p.period_s + 0.5 * p.others_up_mps2 * p.period_s, p.speed_error_mps)
