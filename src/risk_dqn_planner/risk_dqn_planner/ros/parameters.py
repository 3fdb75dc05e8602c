# SPDX-License-Identifier: Apache-2.0
"""Parameters of nodes, declared from frozen dataclasses so that both always agree.

A field's metadata give `description`, `minimum` and `maximum`. Nested dataclasses become
prefixes ("ego_dimensions.length_m"). Every parameter is fixed once its node has started.
"""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar, get_type_hints

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.node import Node

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.map.loader import LOCAL_XY, MapOrigin, RoadMap, load_map
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY, DEFAULT_SUPERVISOR
from risk_dqn_planner.policies.supervised import supervisor_mode
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.vehicle import TrafficLimits, VehicleDimensions

Config = TypeVar("Config")

_SCALARS = (bool, int, float, str)
_UNITS = {
    "_m": "m", "_mps": "m/s", "_mps2": "m/s^2", "_s": "s", "_rad": "rad", "_deg": "degrees",
    "_hz": "Hz",
}  # fmt: skip


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
        default="utm",
        metadata={"description": "utm, local_cartesian, mercator or local_xy"},
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
class PolicyParameters:
    """Which policy decides how often, and what is done about actions that are not sound."""

    policy: str = field(
        default=DEFAULT_POLICY,
        metadata={"description": "Name of a built-in or trained policy, or a policy file"},
    )
    supervisor: str = field(
        default=DEFAULT_SUPERVISOR,
        metadata={
            "description": "What the joint worst-case check does about the policy's actions: off, "
            "report (decisions say what is not sound) or enforce (a sound action stands in)"
        },
    )
    rate_hz: float = field(
        default=2.0,
        metadata={
            "description": "Decisions a second; learned policies are trained for 2 [Hz]",
            "minimum": 0.1,
            "maximum": 20.0,
        },
    )
    marker_frame: str = field(
        default="base_link",
        metadata={"description": "Frame at whose origin the decision is written for RViz"},
    )

    def __post_init__(self) -> None:
        supervisor_mode(self.supervisor)


def declare_assumptions(node: Node, rate_hz: float, prefix: str = "safety.") -> SafetyAssumptions:
    """Declare what the supervisor takes for granted; the period between decisions follows.

    Raises:
        ConfigurationError: as `declare`.
    """
    # Lanes bring their limits and the check reads no width: parameters without use would deceive.
    unused_limit = {"default_speed_limit_mps": TrafficLimits.default_speed_limit_mps}
    unused_width = {"width_m": VehicleDimensions.width_m}
    given = {
        "decision_period_s": 1.0 / rate_hz,
        "traffic": declare(node, TrafficLimits, f"{prefix}traffic.", unused_limit),
        "vehicle": declare(node, VehicleDimensions, f"{prefix}vehicle.", unused_width),
    }
    return declare(node, SafetyAssumptions, prefix, given)


def declare(
    node: Node,
    config_type: type[Config],
    prefix: str = "",
    given: Mapping[str, Any] | None = None,
) -> Config:
    """Declare a parameter for each field of a dataclass and return what was configured.

    given: values of fields that are no parameters of their own. Fields that are neither numbers,
    text nor dataclasses keep their defaults.

    Raises:
        ConfigurationError: a value has the wrong type, is out of range or contradicts another.
    """
    hints = get_type_hints(config_type)
    defaults = config_type()
    values: dict[str, Any] = dict(given or {})
    for item in dataclasses.fields(defaults):  # type: ignore[arg-type]
        kind, name = hints[item.name], prefix + item.name
        if item.name in values:
            continue
        if isinstance(kind, type) and dataclasses.is_dataclass(kind):
            values[item.name] = declare(node, kind, f"{name}.")
        elif kind in _SCALARS:
            default = kind(getattr(defaults, item.name))
            values[item.name] = _declare_one(node, name, default, item.metadata)
    return config_type(**values)


def _declare_one(node: Node, name: str, default: Any, metadata: Any) -> Any:  # noqa: ANN401
    descriptor = ParameterDescriptor(
        description=metadata.get("description", _described(name)), read_only=True
    )
    low, high = metadata.get("minimum"), metadata.get("maximum")
    if low is not None and high is not None:
        if isinstance(default, float):
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(low), to_value=float(high), step=0.0)
            ]
        else:
            descriptor.integer_range = [
                IntegerRange(from_value=int(low), to_value=int(high), step=1)
            ]
    try:
        return node.declare_parameter(name, default, descriptor).value
    except ParameterException as error:
        expected = _expected(default, low, high)
        reason = " ".join(str(error).split())
        raise ConfigurationError(f"parameter {name}: {reason} (expected {expected})") from error


def _expected(default: object, low: float | None, high: float | None) -> str:
    names = {bool: "true or false", int: "an integer", float: "a number such as 2.0", str: "text"}
    bounds = "" if low is None or high is None else f" from {low:g} to {high:g}"
    return names[type(default)] + bounds


def _described(name: str) -> str:
    """Return a description from a name such as "ego_dimensions.length_m"."""
    words = name.replace(".", " ")
    for suffix, unit in _UNITS.items():
        if name.endswith(suffix):
            return f"{words.removesuffix(suffix).replace('_', ' ').capitalize()} [{unit}]"
    return words.replace("_", " ").capitalize()
