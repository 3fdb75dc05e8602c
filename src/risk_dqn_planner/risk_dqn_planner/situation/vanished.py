# SPDX-License-Identifier: Apache-2.0
"""Vehicles that went out of sight after the visible area was taken.

A visible area that is older than the objects cannot tell where a vehicle is hidden that was seen
when it was taken: to it that place is free. Until there is an area from when the vehicle was missed
first, it may be wherever it can have got to.
"""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.situation.config import TrackingConfig
from risk_dqn_planner.situation.situations import Floats, Integers, Situations


class Released(NamedTuple):
    """Where vehicles may be whom the area at hand tells of, all (R,): lane, distances [m]."""

    lane: Integers
    near_m: Floats
    far_m: Floats


NOBODY = Released(np.empty(0, dtype=np.int64), np.empty(0), np.empty(0))


class Vanished:
    """By lane, between which distances to the zone's centre vehicles may be that were missed."""

    def __init__(self, limit_mps: Floats, tracking: TrackingConfig) -> None:
        """Miss nobody yet; limit_mps (M,): highest speeds of hidden vehicles."""
        self._limit_mps = limit_mps
        self._tracking = tracking
        self.forget()

    def forget(self) -> None:
        """Miss nobody."""
        count = len(self._limit_mps)
        self._time_s = math.inf
        self._near_m, self._far_m = np.full(count, np.inf), np.full(count, -np.inf)
        self._since_s = np.full(count, -np.inf)  # when the last one was missed first
        self._id = self._lane = np.empty(0, dtype=np.int64)
        self._distance_m = np.empty(0)

    def look(self, time_s: float, area_age_s: float, ids: Integers, seen: Situations) -> Released:
        """Take note of the objects (N,) perceived at a time, and of those matched to lanes.

        Returns whom the area can tell of from now on.
        """
        if not self._time_s <= time_s < math.inf:
            self.forget()
        else:
            elapsed_s = time_s - self._time_s
            self._near_m -= self._limit_mps * elapsed_s
            self._far_m -= self._tracking.min_speed_mps * elapsed_s
            if area_age_s > 0.0:
                self._miss(time_s, elapsed_s, ids)
        self._time_s = time_s
        mask = seen.vehicle_mask[0]
        self._id, self._lane = seen.vehicle_id[0, mask], seen.vehicle_lane[0, mask]
        self._distance_m = seen.vehicle_distance_m[0, mask]
        return self._release(time_s - area_age_s)

    @property
    def nearest_m(self) -> Floats:
        """Return the nearest place (M,) where somebody may be who was missed, infinity if none."""
        return self._near_m

    def _miss(self, time_s: float, elapsed_s: float, ids: Integers) -> None:
        gone = ~np.isin(self._id, ids)
        if not gone.any():
            return
        lane, at_m = self._lane[gone], self._distance_m[gone]
        margin_m = self._tracking.vehicle_margin_m
        near_m = at_m - self._limit_mps[lane] * elapsed_s - margin_m
        np.minimum.at(self._near_m, lane, near_m)
        far_m = at_m - self._tracking.min_speed_mps * elapsed_s + margin_m
        np.maximum.at(self._far_m, lane, far_m)
        self._since_s[lane] = time_s

    def _release(self, area_time_s: float) -> Released:
        told = (self._since_s <= area_time_s) & np.isfinite(self._near_m)
        lane = np.flatnonzero(told)
        released = Released(lane, self._near_m[lane], self._far_m[lane])
        self._near_m[lane], self._far_m[lane] = np.inf, -np.inf
        return released
