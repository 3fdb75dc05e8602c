# SPDX-License-Identifier: Apache-2.0
"""What decides how an intersection model is built from a map."""

import math
from dataclasses import dataclass, field, fields

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.vehicle import TrafficLimits, VehicleDimensions


@dataclass(frozen=True)
class IntersectionConfig:
    """Assumptions about vehicles, and distances that bound the model.

    sensor_range_m: lanes are followed this far upstream of their zones.
    default_speed_limit_mps: v_o where the map states no limit.
    stop_line_setback_m: a derived stop position lies this far before the first zone.
    max_stop_line_distance_m: a stop line farther before the first zone belongs elsewhere.
    goal_beyond_m: the goal lies this far past the end of the last zone.
    leaders_beyond_goal_m: who has merged matters up to this far past the goal, 0 or more: an ego
        that drives on shall see whom it might run into.
    ego_upstream_m: the ego's path begins at least this far before its route.
    downstream_m: intersecting lanes are followed this far past the lanelet of their zone.
    hairline_m: contacts shorter than this along the ego's path are no conflicts.
    max_height_difference_m: beyond it one way passes over the other.
    """

    ego_dimensions: VehicleDimensions = field(default_factory=VehicleDimensions)
    traffic_dimensions: VehicleDimensions = field(default_factory=VehicleDimensions)
    sensor_range_m: float = 70.0
    default_speed_limit_mps: float = TrafficLimits.default_speed_limit_mps
    stop_line_setback_m: float = 2.5
    max_stop_line_distance_m: float = 15.0
    goal_beyond_m: float = 17.0
    leaders_beyond_goal_m: float = 15.0
    ego_upstream_m: float = 60.0
    downstream_m: float = 40.0
    hairline_m: float = 0.5
    max_height_difference_m: float = 2.5

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, VehicleDimensions):
                continue
            may_be_0 = item.name == "leaders_beyond_goal_m"
            if not (math.isfinite(value) and (value > 0.0 or (may_be_0 and value == 0.0))):
                expected = "0 or more" if may_be_0 else "a number above 0"
                raise ConfigurationError(
                    f"IntersectionConfig.{item.name} is {value}, expected {expected}"
                )
