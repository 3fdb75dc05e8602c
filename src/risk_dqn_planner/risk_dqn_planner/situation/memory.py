# SPDX-License-Identifier: Apache-2.0
"""The memory of one vehicle on one route: what it has seen of the lanes, and when."""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.hidden_pieces import hidden_pieces_kernel, looked_at
from risk_dqn_planner.situation.hidden_space import (
    HiddenSpace,
    HiddenWork,
    carry_on,
    elapsed_since,
    empty_hidden_space,
    find_lost,
    hidden_work,
    keep_seen,
)
from risk_dqn_planner.situation.inputs import EgoPose
from risk_dqn_planner.situation.paths import PathTable
from risk_dqn_planner.situation.situations import Floats, Situations
from risk_dqn_planner.situation.vanished import NOBODY, Released


@allocating_kernel
def look_kernel(
    table: PathTable,
    exit_m: Floats,
    end_m: Floats,
    polygon: Floats,
    sensor_range: float,
    time_s: float,
    limit_mps: Floats,
    slowest_mps: float,
    visible_margin_m: float,
    area_age_s: float,
    vehicle_margin_m: float,
    released: Released,
    situations: Situations,
    space: HiddenSpace,
    work: HiddenWork,
) -> Floats:
    """Bring all sets to the present; return each lane's nearest place of a hidden vehicle (M,).

    exit_m, end_m (P,): see `looked_at`. limit_mps (M,): of hidden vehicles. area_age_s: between
    what the polygon shows and `time_s`; meanwhile they may have come into it. released: vehicles
    that were missed before the polygon was taken. `sensor_range` where there is no place.
    """
    mask, ids = situations.vehicle_mask, situations.vehicle_id
    elapsed = elapsed_since(space.time_s[0], time_s)
    space.time_s[0] = time_s
    lost = find_lost(
        space.seen,
        space.seen_id,
        space.seen_lane,
        space.seen_distance_m,
        0,
        mask,
        ids,
        elapsed,
        limit_mps,
        slowest_mps,
        vehicle_margin_m,
        work.lost_lane,
        work.lost_near_m,
        work.lost_far_m,
    )
    for k in range(len(released.lane)):
        work.lost_lane[lost] = released.lane[k]
        work.lost_near_m[lost], work.lost_far_m[lost] = released.near_m[k], released.far_m[k]
        lost += 1
    for p in range(len(table.lane)):
        work.hidden[p] = hidden_pieces_kernel(
            table,
            p,
            polygon,
            exit_m[p],
            end_m[p],
            visible_margin_m + limit_mps[table.lane[p]] * area_age_s,
            work.hidden_near_m,
            work.hidden_far_m,
        )
    nearest = np.full((1, len(limit_mps)), sensor_range)
    carry_on(
        space.near_m,
        space.far_m,
        space.held,
        0,
        table.lane,
        exit_m,
        end_m,
        elapsed,
        limit_mps,
        slowest_mps,
        work.lost_lane,
        work.lost_near_m,
        work.lost_far_m,
        lost,
        work.hidden_near_m,
        work.hidden_far_m,
        work.hidden,
        work.grown_near_m,
        work.grown_far_m,
        nearest,
    )
    keep_seen(
        space.seen,
        space.seen_id,
        space.seen_lane,
        space.seen_distance_m,
        0,
        mask,
        ids,
        situations.vehicle_lane,
        situations.vehicle_distance_m,
    )
    result: Floats = nearest[0]
    return result


class Look(NamedTuple):
    """What the ego sees at a time on any clock: vehicles (a batch of one), and the area [m].

    visible_area (K, 2), as old as `Perception` says. released: whom it can tell of at last.
    """

    time_s: float
    ego: EgoPose
    seen: Situations
    visible_area: Floats
    visible_area_age_s: float
    released: Released = NOBODY


class LaneMemory:
    """Where hidden vehicles may be on the paths of one model; to be told of every look."""

    def __init__(self, table: PathTable, limit_mps: Floats, config: SituationConfig) -> None:
        """Know nothing yet; limit_mps (M,): speed limits of the lanes."""
        self._table = table
        self._config = config
        self._limit_mps = limit_mps * config.tracking.speed_factor
        self._space = empty_hidden_space(1, len(table.lane), 1)
        self._work = hidden_work(len(table.lane), 1 + len(limit_mps))
        self._bounds = looked_at(table, config.sensor_range_m)
        self._ego: EgoPose | None = None

    def forget(self) -> None:
        """Start anew: whatever is hidden at the next look may hold a vehicle."""
        self._space = empty_hidden_space(1, len(self._table.lane), self._space.seen_id.shape[1])
        self._ego = None

    def look(self, look: Look) -> Floats:
        """Return each lane's nearest place of a hidden vehicle (M,).

        An ego that cannot have driven from where it was to where it is has been localised anew:
        then the memory starts anew.
        """
        if self._has_jumped(look.time_s, look.ego):
            self.forget()
        self._make_room(look.seen.vehicle_mask.shape[1])
        tracking = self._config.tracking
        nearest: Floats = look_kernel(
            self._table,
            *self._bounds,
            np.ascontiguousarray(look.visible_area, dtype=np.float64),
            self._config.sensor_range_m,
            look.time_s,
            self._limit_mps,
            tracking.min_speed_mps,
            tracking.visible_margin_m,
            look.visible_area_age_s,
            tracking.vehicle_margin_m,
            look.released,
            look.seen,
            self._space,
            self._work,
        )
        self._ego = look.ego
        return nearest

    def intervals(self) -> list[list[tuple[float, float]]]:
        """Return the set of each path (P): nearest and furthest distance of its intervals [m]."""
        space = self._space
        return [
            [(float(space.near_m[p, k]), float(space.far_m[p, k])) for k in range(space.held[p])]
            for p in range(len(self._table.lane))
        ]

    def _has_jumped(self, time_s: float, ego: EgoPose) -> bool:
        last, elapsed_s = self._ego, time_s - float(self._space.time_s[0])
        if last is None or elapsed_s < 0.0:
            return False
        way_m = max(abs(last.speed_mps), abs(ego.speed_mps)) * elapsed_s
        moved_m = math.hypot(ego.x_m - last.x_m, ego.y_m - last.y_m)
        return moved_m > way_m + self._config.tracking.jump_m

    def _make_room(self, vehicles: int) -> None:
        space = self._space
        room = space.seen_id.shape[1]
        if vehicles <= room:
            return
        more = ((0, 0), (0, vehicles - room))
        self._space = space._replace(
            seen_id=np.pad(space.seen_id, more),
            seen_lane=np.pad(space.seen_lane, more),
            seen_distance_m=np.pad(space.seen_distance_m, more),
        )
        # Those who were missed before are one more for each lane at most.
        self._work = hidden_work(len(self._table.lane), vehicles + len(self._limit_mps))
