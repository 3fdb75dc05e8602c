# SPDX-License-Identifier: Apache-2.0
"""What is assumed of vehicles: footprints, and how fast they speed up and brake."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from risk_dqn_planner.errors import ConfigurationError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def require_positive(config: "DataclassInstance", skip: tuple[str, ...] = ()) -> None:
    """Raise ConfigurationError naming the first field of a dataclass that is not above zero.

    skip: names of fields that need not be.
    """
    for field in fields(config):
        if field.name in skip:
            continue
        value = getattr(config, field.name)
        if not value > 0.0:
            raise ConfigurationError(
                f"{type(config).__name__}.{field.name} is {value}, expected a number above 0"
            )


@dataclass(frozen=True)
class VehicleDimensions:
    """Footprint of a vehicle, a rectangle about its centre [m]."""

    length_m: float = 4.0
    width_m: float = 2.0

    def __post_init__(self) -> None:
        require_positive(self)


@dataclass(frozen=True)
class EgoLimits:
    """How the ego carries out decisions: Stop brakes, Slow and Fast are target speeds.

    Paper, "Action Space" (5 m/s, 1 m/s) and a_max^e; the braking is the project's default.
    """

    acceleration_mps2: float = 1.5
    braking_mps2: float = 3.5
    fast_mps: float = 5.0
    slow_mps: float = 1.0

    def __post_init__(self) -> None:
        require_positive(self)
        if self.slow_mps >= self.fast_mps:
            raise ConfigurationError(
                f"EgoLimits.slow_mps is {self.slow_mps}, expected less than "
                f"fast_mps ({self.fast_mps})"
            )


@dataclass(frozen=True)
class TrafficLimits:
    """What the worst case grants other vehicles: a_max^i, and v_o where the map has no limit."""

    acceleration_mps2: float = 2.0
    default_speed_limit_mps: float = 7.0

    def __post_init__(self) -> None:
        require_positive(self)
