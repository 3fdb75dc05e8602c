# SPDX-License-Identifier: Apache-2.0
"""Small intersections made by hand, whose numbers can be checked with a pencil."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from hypothesis import settings

from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import (
    ConflictKind,
    ConflictPath,
    IntersectingLane,
    IntersectionModel,
    LanePath,
    StopLine,
)
from risk_dqn_planner.vehicle import VehicleDimensions
from sim_bridge.scenarios.fields import Interval, Obstacles
from sim_bridge.scenarios.loading import Scenario, load_scenario

# The first example of a test may wait for the compiler.
settings.register_profile("compiled", deadline=None)
settings.load_profile("compiled")

Point = tuple[float, float]


def lane_path(lanelet_id: int, points: Sequence[Point]) -> LanePath:
    return LanePath((lanelet_id,), (0.0,), Polyline.from_points(points), 1.75)


def crossing_lane(
    lane_id: int, points: Sequence[Point], zone_m: float, ego_zone_m: float
) -> IntersectingLane:
    """A lane that crosses at a right angle: zones of 6 m."""
    path = ConflictPath(lane_path(lane_id, points), zone_m, math.inf)
    return IntersectingLane(
        lane_id, ConflictKind.CROSSING, 7.0, ego_zone_m, 6.0, 6.0, math.inf, (path,)
    )


def model_of(*lanes: IntersectingLane, goal_m: float = 120.0) -> IntersectionModel:
    """The ego comes from the south on x = 0; its path begins at y = -100, the line is at -6."""
    return IntersectionModel(
        route=(1,),
        ego_path=lane_path(1, [(0.0, -100.0), (0.0, 60.0)]),
        lanes=lanes,
        stop_line=StopLine(94.0, None),
        goal_m=goal_m,
        leaders_until_m=goal_m + 15.0,
        ego_dimensions=VehicleDimensions(),
        traffic_dimensions=VehicleDimensions(),
        notes=(),
    )


@pytest.fixture(scope="session")
def crossing_model() -> IntersectionModel:
    """From the west on y = 0, zone at s = 100; from the east on y = 3.5, zone at s = 100."""
    return model_of(
        crossing_lane(10, [(-100.0, 0.0), (60.0, 0.0)], 100.0, 100.0),
        crossing_lane(11, [(100.0, 3.5), (-60.0, 3.5)], 100.0, 103.5),
    )


@pytest.fixture(scope="session")
def merging_model() -> IntersectionModel:
    """A lane from the west turns left into the ego's lane, which it has joined at y = 10."""
    arc = [
        (-10.0 + 10.0 * math.sin(turn), 10.0 * (1.0 - math.cos(turn)))
        for turn in (math.radians(5.0 * k) for k in range(19))
    ]
    line = lane_path(20, [(-100.0, 0.0), *arc, (0.0, 60.0)])
    join_m = line.centerline.length_m - 50.0
    lane = IntersectingLane(
        lane_id=20,
        kind=ConflictKind.MERGING,
        speed_limit_mps=7.0,
        ego_zone_center_m=107.0,
        ego_zone_length_m=6.0,
        zone_length_m=6.0,
        ego_join_m=110.0,
        paths=(ConflictPath(line, join_m - 3.0, join_m),),
    )
    return model_of(lane, goal_m=130.0)


@pytest.fixture(scope="session")
def base() -> Scenario:
    return load_scenario("base")


def exactly(scenario: Scenario, count: int, **traffic: object) -> Scenario:
    """The scenario with so many vehicles, and other fields of its traffic."""
    fields = {"vehicles": Interval(count, count), **traffic}
    return replace(scenario, traffic=replace(scenario.traffic, **fields))


@pytest.fixture(scope="session")
def with_vehicles() -> Callable[..., Scenario]:
    return exactly


@pytest.fixture(scope="session")
def empty_road(base: Scenario) -> Scenario:
    """Base without vehicles and without obstacles."""
    return replace(exactly(base, 0), obstacles=Obstacles(per_side=0))


@pytest.fixture(scope="session")
def busy(base: Scenario) -> Scenario:
    """Base with exactly six vehicles."""
    return exactly(base, 6)
