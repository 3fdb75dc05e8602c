# SPDX-License-Identifier: Apache-2.0
"""Settings of how perceived things are related to lanes."""

import math
from dataclasses import dataclass, field

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.vehicle import require_positive


@dataclass(frozen=True)
class SituationConfig:
    """Tolerances of the matching and limits of what is seen.

    The metadata describe each field where it becomes a parameter of a node.
    """

    sensor_range_m: float = field(
        default=70.0,
        metadata={
            "description": "Cap of the distance to hidden vehicles where a whole lane is seen [m]",
            "minimum": 1.0,
            "maximum": 500.0,
        },
    )
    lateral_tolerance_m: float = field(
        default=0.3,
        metadata={
            "description": "A vehicle's centre may lie this far outside its lane [m]",
            "minimum": 0.01,
            "maximum": 3.0,
        },
    )
    max_heading_difference_rad: float = field(
        default=math.radians(60.0),
        metadata={
            "description": "Vehicles turned further away from a lane are not on it [rad]",
            "minimum": 0.01,
            "maximum": math.pi / 2,
        },
    )
    max_ego_offset_m: float = field(
        default=2.0,
        metadata={
            "description": "The ego is off its route when further beside its path [m]",
            "minimum": 0.1,
            "maximum": 20.0,
        },
    )
    max_ego_heading_difference_rad: float = field(
        default=math.radians(60.0),
        metadata={
            "description": "The ego faces the wrong way when turned further away [rad]",
            "minimum": 0.01,
            "maximum": math.pi,
        },
    )

    def __post_init__(self) -> None:
        require_positive(self)
        if self.max_heading_difference_rad > math.pi / 2:
            raise ConfigurationError(
                "SituationConfig.max_heading_difference_rad is "
                f"{self.max_heading_difference_rad:g}, expected at most a right angle: "
                "beyond it an oncoming vehicle would count as on the lane"
            )
