# SPDX-License-Identifier: Apache-2.0
"""Settings of how perceived things are related to lanes."""

import math
from dataclasses import dataclass, field

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.vehicle import require_positive

INSTANTANEOUS = "instantaneous"
TRACKED = "tracked"


@dataclass(frozen=True)
class TrackingConfig:
    """What is assumed of hidden vehicles while they are remembered (docs/hidden_space.md)."""

    min_speed_mps: float = field(
        default=0.0,
        metadata={
            "description": "Hidden vehicles are never slower than this; above 0 they are taken "
            "never to stop [m/s]",
            "minimum": 0.0,
            "maximum": 30.0,
        },
    )
    speed_factor: float = field(
        default=1.0,
        metadata={
            "description": "Hidden vehicles are never faster than the lane's limit times this",
            "minimum": 0.1,
            "maximum": 3.0,
        },
    )
    vehicle_margin_m: float = field(
        default=0.5,
        metadata={
            "description": "A vehicle may have been this far from the place along its lane where "
            "it was last seen [m]",
            "minimum": 0.0,
            "maximum": 10.0,
        },
    )
    visible_margin_m: float = field(
        default=0.0,
        metadata={
            "description": "Places nearer than this along a lane to a hidden one are taken for "
            "hidden [m]",
            "minimum": 0.0,
            "maximum": 10.0,
        },
    )
    jump_m: float = field(
        default=2.0,
        metadata={
            "description": "An ego this much further away than it can have driven has been "
            "localised anew, and forgets [m]",
            "minimum": 0.1,
            "maximum": 100.0,
        },
    )

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if not 0.0 <= value < math.inf:
                raise ConfigurationError(
                    f"TrackingConfig.{name} is {value}, expected a finite number, 0 or more"
                )
        if not self.speed_factor > 0.0:
            raise ConfigurationError("TrackingConfig.speed_factor is 0, expected more")


def require_memory(kind: str) -> None:
    """Raise ConfigurationError unless `kind` names a memory: instantaneous or tracked."""
    if kind not in (INSTANTANEOUS, TRACKED):
        raise ConfigurationError(f"memory is {kind!r}, expected {INSTANTANEOUS!r} or {TRACKED!r}")


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
    position_error_m: float = field(
        default=0.0,
        metadata={
            "description": "Perceived places along lanes are off by no more than this: nobody has "
            "left a zone before; as safety.position_error_m of the policy node [m]",
            "minimum": 0.0,
            "maximum": 20.0,
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
    memory: str = field(
        default=INSTANTANEOUS,
        metadata={
            "description": "Where hidden vehicles may be: instantaneous (wherever the ego does not "
            "see now, as in the paper) or tracked (less what it has seen to be free)"
        },
    )
    tracking: TrackingConfig = field(default_factory=TrackingConfig)

    def __post_init__(self) -> None:
        require_positive(self, skip=("memory", "tracking", "position_error_m"))
        if not 0.0 <= self.position_error_m < math.inf:
            raise ConfigurationError(
                f"SituationConfig.position_error_m is {self.position_error_m}, expected a finite "
                "number, 0 or more"
            )
        require_memory(self.memory)
        if self.max_heading_difference_rad > math.pi / 2:
            raise ConfigurationError(
                "SituationConfig.max_heading_difference_rad is "
                f"{self.max_heading_difference_rad:g}, expected at most a right angle: "
                "beyond it an oncoming vehicle would count as on the lane"
            )
