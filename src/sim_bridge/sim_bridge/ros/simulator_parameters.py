# SPDX-License-Identifier: Apache-2.0
"""Parameters of the simulator node beside those of the map."""

from dataclasses import dataclass, field

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from risk_dqn_planner.errors import ConfigurationError


@dataclass(frozen=True)
class SimulatorParameters:
    """What is simulated, and how fast."""

    scenario: str = field(
        default="base",
        metadata={"description": "Name of a scenario, or a scenario file ending in .yaml"},
    )
    seed: int = field(
        default=0,
        metadata={
            "description": "Seed of the first episode; the next ones count on",
            "minimum": 0,
            "maximum": 2**31 - 1,
        },
    )
    autostart: bool = field(
        default=True,
        metadata={"description": "Start episodes one after the other without being asked"},
    )
    lockstep: bool = field(
        default=True,
        metadata={
            "description": "Simulated time waits for the planner: the same decisions on every "
            "computer; else the newest decision counts"
        },
    )
    real_time_factor: float = field(
        default=1.0,
        metadata={
            "description": "Highest ratio of simulated to real time; 0 for as fast as possible",
            "minimum": 0.0,
            "maximum": 100.0,
        },
    )
    decision_timeout_s: float = field(
        default=5.0,
        metadata={
            "description": "In lock-step, a decision that takes longer in real time counts as "
            "late and the ego brakes [s]",
            "minimum": 0.01,
            "maximum": 600.0,
        },
    )

    def __post_init__(self) -> None:
        if not self.lockstep and self.real_time_factor == 0.0:
            raise ConfigurationError(
                "parameter real_time_factor is 0 without lockstep, expected a number above 0: "
                "nobody would wait for the planner"
            )


def declare_route(node: Node) -> list[int]:
    """Declare the parameter `route` and return it.

    Raises:
        ConfigurationError: it is not set, or no list of whole numbers.
    """
    descriptor = ParameterDescriptor(
        description="Lanelets of the ego's route in driving order (required)", read_only=True
    )
    try:
        node.declare_parameter("route", Parameter.Type.INTEGER_ARRAY, descriptor)
        return list(node.get_parameter("route").value)
    except ParameterException as error:
        raise ConfigurationError(
            "parameter route is not set, expected a list of lanelet ids such as [1, 9, 4]"
        ) from error
