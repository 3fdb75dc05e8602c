# SPDX-License-Identifier: Apache-2.0
"""What is assumed of vehicles: footprints, and how fast they speed up and brake."""

import math
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

from risk_dqn_planner.errors import ConfigurationError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def require_positive(config: "DataclassInstance", skip: tuple[str, ...] = ()) -> None:
    """Raise ConfigurationError for the first field that is no finite number above zero.

    skip: names of fields that need not be.
    """
    for item in fields(config):
        if item.name in skip:
            continue
        value = getattr(config, item.name)
        if not 0.0 < value < math.inf:
            raise ConfigurationError(
                f"{type(config).__name__}.{item.name} is {value}, expected a number above 0"
            )


def require_in_range(config: "DataclassInstance") -> None:
    """Raise ConfigurationError for the first number outside of what its metadata allow.

    `minimum` and `maximum` are what parameters of nodes are declared with, so that training and
    evaluation take no value that the vehicle refuses. Without them a number need only be finite.
    """
    for item in fields(config):
        value = getattr(config, item.name)
        if isinstance(value, bool) or not isinstance(value, int | float):
            continue
        low = item.metadata.get("minimum", -math.inf)
        high = item.metadata.get("maximum", math.inf)
        if math.isfinite(value) and low <= value <= high:
            continue
        expected = "a finite number" if high == math.inf else f"{low:g} to {high:g}"
        raise ConfigurationError(
            f"{type(config).__name__}.{item.name} is {value}, expected {expected}"
        )


def _limit(default: float, maximum: float) -> float:
    """Return a field for a limit of motion that no road vehicle is beyond."""
    limit: float = field(default=default, metadata={"minimum": 0.01, "maximum": maximum})
    return limit


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

    acceleration_mps2: float = _limit(1.5, 20.0)
    braking_mps2: float = _limit(3.5, 20.0)
    fast_mps: float = _limit(5.0, 50.0)
    slow_mps: float = _limit(1.0, 50.0)

    def __post_init__(self) -> None:
        require_in_range(self)
        if self.slow_mps >= self.fast_mps:
            raise ConfigurationError(
                f"EgoLimits.slow_mps is {self.slow_mps}, expected less than "
                f"fast_mps ({self.fast_mps})"
            )


@dataclass(frozen=True)
class TrafficLimits:
    """What the worst case grants other vehicles: a_max^i, and v_o where the map has no limit."""

    acceleration_mps2: float = _limit(2.0, 20.0)
    default_speed_limit_mps: float = _limit(7.0, 100.0)

    def __post_init__(self) -> None:
        require_in_range(self)
