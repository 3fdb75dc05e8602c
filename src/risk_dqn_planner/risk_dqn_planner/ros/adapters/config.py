# SPDX-License-Identifier: Apache-2.0
"""What is made of objects of other stacks where their messages leave a doubt."""

from dataclasses import dataclass, field

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.vehicle import TrafficLimits, require_positive

NOTHING = "nothing"
NOT_OBSTACLES = "not_obstacles"
NOT_VEHICLES = "not_vehicles"
LEFT_OUT = (NOTHING, NOT_OBSTACLES, NOT_VEHICLES)


@dataclass(frozen=True)
class AdapterConfig:
    """Which objects count as vehicles, and how fast one is whose speed nobody has measured.

    Whatever is not surely something else counts as a vehicle: doubt must not make it vanish.
    """

    left_out: str = field(
        default=NOT_OBSTACLES,
        metadata={
            "description": "Objects of other stacks that do not count as vehicles: nothing, "
            "not_obstacles (signs, and what can be driven over or under) or not_vehicles "
            "(also pedestrians, animals and barriers)"
        },
    )
    min_certainty: float = field(
        default=0.9,
        metadata={
            "description": "Objects are left out only where their class is at least so certain",
            "minimum": 0.01,
            "maximum": 1.0,
        },
    )
    unknown_speed_mps: float = field(
        default=TrafficLimits.default_speed_limit_mps,
        metadata={
            "description": "Speed of detected objects whose speed nobody has measured [m/s]",
            "minimum": 0.0,
            "maximum": 30.0,
        },
    )

    def __post_init__(self) -> None:
        require_positive(self, skip=("left_out", "unknown_speed_mps"))
        if self.left_out not in LEFT_OUT:
            raise ConfigurationError(
                f"objects left out: {self.left_out!r}, expected one of {', '.join(LEFT_OUT)}"
            )
        if not self.min_certainty <= 1.0:
            raise ConfigurationError(
                f"AdapterConfig.min_certainty is {self.min_certainty:g}, expected at most 1"
            )
        if not 0.0 <= self.unknown_speed_mps < float("inf"):
            raise ConfigurationError(
                f"AdapterConfig.unknown_speed_mps is {self.unknown_speed_mps:g}, "
                "expected a finite number, 0 or more"
            )
