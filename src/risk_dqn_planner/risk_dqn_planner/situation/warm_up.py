# SPDX-License-Identifier: Apache-2.0
"""A small situation that no map is needed for: nodes compile the hot paths on it before they start.

Without it the first message would wait for the compiler, or for its cache on disk.
"""

import math

import numpy as np

from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import (
    ConflictKind,
    ConflictPath,
    IntersectingLane,
    IntersectionModel,
    LanePath,
    StopLine,
)
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.inputs import EgoPose, Perception, object_arrays
from risk_dqn_planner.situation.situations import Floats, Situations
from risk_dqn_planner.vehicle import VehicleDimensions

EGO_SPEED_MPS = 5.0


def crossing_model() -> IntersectionModel:
    """Return a perpendicular crossing at the origin: the ego drives east, the other lane north.

    The ego's path runs from x = -60 to 40 m with its stop line at -6 m and its goal at 20 m;
    lane 1 runs from y = -70 to 30 m; zones of 6 m (the paper's l) about the origin.
    """
    ego = LanePath((10,), (0.0,), Polyline.from_points([[-60.0, 0.0], [40.0, 0.0]]), 1.75)
    other = LanePath((1,), (0.0,), Polyline.from_points([[0.0, -70.0], [0.0, 30.0]]), 1.75)
    lane = IntersectingLane(
        lane_id=1,
        kind=ConflictKind.CROSSING,
        speed_limit_mps=7.0,
        ego_zone_center_m=60.0,
        ego_zone_length_m=6.0,
        zone_length_m=6.0,
        ego_join_m=math.inf,
        paths=(ConflictPath(other, zone_center_m=70.0, join_m=math.inf),),
    )
    return IntersectionModel(
        route=(10,),
        ego_path=ego,
        lanes=(lane,),
        stop_line=StopLine(position_m=54.0, lanelet2_id=None),
        goal_m=80.0,
        leaders_until_m=90.0,
        ego_dimensions=VehicleDimensions(),
        traffic_dimensions=VehicleDimensions(),
        notes=(),
    )


def square(half_size_m: float) -> Floats:
    """Return a visible area (4, 2): a square about the origin."""
    h = half_size_m
    return np.array([[-h, -h], [h, -h], [h, h], [-h, h]])


def example_perception() -> Perception:
    """Return what the ego sees 20 m before the crossing: one vehicle, the lane free for 40 m."""
    ego = EgoPose(-20.0, 0.0, 0.0, EGO_SPEED_MPS)
    vehicle = object_arrays([[0.0, -30.0, math.pi / 2, EGO_SPEED_MPS]])
    return Perception(ego, vehicle, square(40.0))


def example_situation(config: SituationConfig | None = None) -> Situations:
    """Return the situation of the example: 20 m before the crossing."""
    builder = SituationBuilder(crossing_model(), config)
    return builder.build(*example_perception())
