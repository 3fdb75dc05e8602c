# SPDX-License-Identifier: Apache-2.0
"""The nodes' own parameters; those of the core are fields of its configurations."""

import math
from dataclasses import dataclass, field

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.map.loader import (
    ALL_PROJECTORS,
    DEFAULT_PROJECTOR,
    LOCAL_XY,
    MapOrigin,
    RoadMap,
    load_map,
)
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY, DEFAULT_SUPERVISOR
from risk_dqn_planner.policies.supervised import supervisor_mode
from risk_dqn_planner.ros.declaration import Declared
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.vehicle import TrafficLimits, VehicleDimensions


@dataclass(frozen=True)
class MapParameters:
    """Which map is loaded, and where it lies."""

    map_file: str = field(
        default="", metadata={"description": "Lanelet2 map, an OSM-XML file (required)"}
    )
    map_origin_latitude: float = field(
        default=math.nan,
        metadata={"description": "Latitude of the projection's origin [degrees]"},
    )
    map_origin_longitude: float = field(
        default=math.nan,
        metadata={"description": "Longitude of the projection's origin [degrees]"},
    )
    map_projector: str = field(
        default=DEFAULT_PROJECTOR,
        metadata={"description": ", ".join(ALL_PROJECTORS)},
    )
    map_frame: str = field(
        default="map", metadata={"description": "Frame in which all inputs must be"}
    )

    def load(self) -> RoadMap:
        """Load the map.

        Raises:
            ConfigurationError: a parameter is missing. MapError: the map cannot be used.
        """
        if not self.map_file:
            raise ConfigurationError("parameter map_file is not set, expected a Lanelet2 map")
        if self.map_projector == LOCAL_XY:
            return load_map(self.map_file, None, LOCAL_XY)
        for name in ("map_origin_latitude", "map_origin_longitude"):
            if math.isnan(getattr(self, name)):
                raise ConfigurationError(
                    f"parameter {name} is not set, expected where {self.map_file} is projected from"
                )
        origin = MapOrigin(self.map_origin_latitude, self.map_origin_longitude)
        return load_map(self.map_file, origin, self.map_projector)


@dataclass(frozen=True)
class EgoParameters:
    """How the ego's odometry relates to its footprint."""

    base_to_center_m: float = field(
        default=0.0,
        metadata={
            "description": "The footprint's centre lies this far ahead of base_link [m]",
            "minimum": -10.0,
            "maximum": 10.0,
        },
    )


@dataclass(frozen=True)
class ClockParameters:
    """What simulated time changes: it may stand still and wait for the planner."""

    sim_time_patience_s: float = field(
        default=0.2,
        metadata={
            "description": "With simulated time, messages of the present moment are waited for "
            "this long in real time, so that a busy computer decides the same [s]",
            "minimum": 0.0,
            "maximum": 10.0,
        },
    )


@dataclass(frozen=True)
class StandingClockParameters:
    """When a simulated clock that shows the same time stands."""

    clock_timeout_s: float = field(
        default=0.5,
        metadata={
            "description": "With simulated time, a clock that has shown the same time for this "
            "long in real time stands: Stop, twice a second in real time [s]",
            "minimum": 0.1,
            "maximum": 3600.0,
            "live": True,
        },
    )


@dataclass(frozen=True)
class PolicyParameters:
    """Which policy decides how often, and what is done about actions that are not sound."""

    policy: str = field(
        default=DEFAULT_POLICY,
        metadata={"description": "Name of a built-in or trained policy, or a policy file"},
    )
    trusted_policies: str = field(
        default="",
        metadata={
            "description": "SHA-256 of policy files that may be loaded although they do not come "
            "with the planner, or paths of lists of them, separated by blanks or commas"
        },
    )
    allow_unlisted_policy: bool = field(
        default=False,
        metadata={
            "description": "Load a policy file whatever its hash is; loading one runs its code"
        },
    )
    supervisor: str = field(
        default=DEFAULT_SUPERVISOR,
        metadata={
            "description": "What the joint worst-case check does about the policy's actions: off, "
            "report (decisions say what is not sound) or enforce (a sound action stands in)",
            "live": True,
        },
    )
    rate_hz: float = field(
        default=2.0,
        metadata={
            "description": "Decisions a second; learned policies are trained for 2, and the "
            "joint check reckons with the period that follows; no more than "
            "rates.situation.min_rate_hz [Hz]",
            "minimum": 0.1,
            "maximum": 20.0,
        },
    )
    marker_frame: str = field(
        default="base_link",
        metadata={
            "description": "Frame at whose origin the decision is written for RViz",
            "live": True,
        },
    )

    def __post_init__(self) -> None:
        supervisor_mode(self.supervisor)


# Lanes bring their limits and the check reads no width: parameters without use would deceive.
_UNUSED_LIMIT = {"default_speed_limit_mps": TrafficLimits.default_speed_limit_mps}
_UNUSED_WIDTH = {"width_m": VehicleDimensions.width_m}
_SAFETY = "safety."


def add_assumptions(declared: Declared) -> None:
    """Declare what the supervisor takes for granted.

    Raises:
        ConfigurationError: as `Declared.add`.
    """
    declared.add(TrafficLimits, f"{_SAFETY}traffic.", _UNUSED_LIMIT)
    declared.add(VehicleDimensions, f"{_SAFETY}vehicle.", _UNUSED_WIDTH)
    declared.add(SafetyAssumptions, _SAFETY, ("decision_period_s", "traffic", "vehicle"))


def read_assumptions(declared: Declared, rate_hz: float) -> SafetyAssumptions:
    """Return what the supervisor takes for granted; the period between decisions follows.

    Raises:
        ConfigurationError: as `Declared.read`.
    """
    given = {
        "decision_period_s": 1.0 / rate_hz,
        "traffic": declared.read(TrafficLimits, f"{_SAFETY}traffic.", _UNUSED_LIMIT),
        "vehicle": declared.read(VehicleDimensions, f"{_SAFETY}vehicle.", _UNUSED_WIDTH),
    }
    return declared.read(SafetyAssumptions, _SAFETY, given)
