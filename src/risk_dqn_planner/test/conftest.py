# SPDX-License-Identifier: Apache-2.0
"""Situations for tests: written down by hand, or drawn at random."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from risk_dqn_planner.situation.situations import Situations, empty_situations

# The first example of a test may wait for the compiler, and any for a busy computer.
settings.register_profile("compiled", deadline=None)
settings.load_profile("compiled")


@dataclass(frozen=True)
class Lane:
    """The paper's crossing, seen up to 70 m; distances from the zone's centre."""

    id: int
    ego_m: float
    hidden_m: float = 70.0
    limit_mps: float = 7.0
    zone_m: float = 6.0
    ego_zone_m: float = 6.0
    merging: bool = False


@dataclass(frozen=True)
class Vehicle:
    id: int
    lane: int  # id of its lane
    m: float
    mps: float


MakeSituation = Callable[..., Situations]


def make_situation(
    lanes: Sequence[Mapping[str, Any]] = (),
    vehicles: Sequence[Mapping[str, Any]] = (),
    stop_line_m: float = 0.0,
    goal_m: float = 22.0,
    ego_mps: float = 0.0,
) -> Situations:
    """One situation; lanes and vehicles are given as fields of Lane and Vehicle."""
    s = empty_situations(1, len(vehicles), len(lanes))
    s.stop_line_distance_m[0], s.goal_distance_m[0], s.ego_speed_mps[0] = (
        stop_line_m,
        goal_m,
        ego_mps,
    )
    lane_ids = [lane["id"] for lane in lanes]
    for m, lane in enumerate(Lane(**fields) for fields in lanes):
        s.lane_mask[0, m], s.lane_id[0, m], s.lane_merging[0, m] = True, lane.id, lane.merging
        s.lane_ego_distance_m[0, m], s.lane_hidden_distance_m[0, m] = lane.ego_m, lane.hidden_m
        s.lane_speed_limit_mps[0, m] = lane.limit_mps
        s.lane_ego_zone_m[0, m], s.lane_zone_m[0, m] = lane.ego_zone_m, lane.zone_m
    for n, vehicle in enumerate(Vehicle(**fields) for fields in vehicles):
        s.vehicle_mask[0, n], s.vehicle_id[0, n] = True, vehicle.id
        s.vehicle_lane[0, n] = lane_ids.index(vehicle.lane)
        s.vehicle_distance_m[0, n], s.vehicle_speed_mps[0, n] = vehicle.m, vehicle.mps
    return s


def draw_situations(seed: int, batch: int, vehicles: int = 8, lanes: int = 4) -> Situations:
    """Situations of every kind; some vehicles stand on two lanes, some places are empty."""
    rng = np.random.default_rng(seed)
    n, m = (batch, vehicles), (batch, lanes)
    stop_line_m = rng.uniform(-30.0, 80.0, batch)
    # Unlike ids on each place; about a fifth of them are a second lane of the one before.
    vehicle_id = np.argsort(rng.random((batch, 50)), axis=1)[:, :vehicles] - 10
    vehicle_lane = rng.integers(0, lanes, n)
    for place in range(1, vehicles):
        again = (rng.random(batch) < 0.2) & (vehicle_lane[:, place] != vehicle_lane[:, place - 1])
        again &= (vehicle_id[:, :place] == vehicle_id[:, [place - 1]]).sum(axis=1) == 1
        vehicle_id[again, place] = vehicle_id[again, place - 1]
    return Situations(
        stop_line_distance_m=stop_line_m,
        goal_distance_m=stop_line_m + 22.0,
        ego_speed_mps=rng.uniform(0.0, 6.0, batch),
        vehicle_mask=rng.random(n) < 0.8,
        vehicle_id=vehicle_id,
        vehicle_lane=vehicle_lane,
        vehicle_distance_m=rng.uniform(-20.0, 90.0, n),
        vehicle_speed_mps=rng.normal(5.0, 4.0, n),
        lane_mask=np.arange(lanes) < rng.integers(0, lanes + 1, (batch, 1)),
        lane_id=np.argsort(rng.random((batch, 20)), axis=1)[:, :lanes] + 100,
        lane_merging=rng.random(m) < 0.3,
        lane_ego_distance_m=stop_line_m[:, None] + rng.uniform(3.0, 30.0, m),
        lane_hidden_distance_m=rng.uniform(0.0, 80.0, m),
        lane_speed_limit_mps=rng.uniform(3.0, 14.0, m),
        lane_ego_zone_m=rng.uniform(4.0, 12.0, m),
        lane_zone_m=rng.uniform(4.0, 12.0, m),
    )


def mask_vehicles_without_lane(s: Situations) -> Situations:
    """A vehicle is only ever matched to a lane that is there."""
    lane_there = np.take_along_axis(s.lane_mask, s.vehicle_lane, axis=1)
    return s._replace(vehicle_mask=s.vehicle_mask & lane_there)


@pytest.fixture(scope="session")
def situation() -> MakeSituation:
    return make_situation


@pytest.fixture(scope="session")
def random_situations() -> MakeSituation:
    def draw(seed: int, batch: int, vehicles: int = 8, lanes: int = 4) -> Situations:
        return mask_vehicles_without_lane(draw_situations(seed, batch, vehicles, lanes))

    return draw
