# SPDX-License-Identifier: Apache-2.0
"""Which messages the planner takes objects from, by the name of their type.

Other stacks' packages are imported only when they are asked for: the planner needs none of them.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.ros.adapters.autoware import objects_from_tracked
from risk_dqn_planner.ros.adapters.config import AdapterConfig
from risk_dqn_planner.ros.adapters.derived import objects_from_derived
from risk_dqn_planner.ros.conversions import objects_from_records, read_objects
from risk_dqn_planner.ros.records import RecordList, RecordReader
from risk_dqn_planner.situation.inputs import ObjectArrays

OWN_TYPE = "intersection_msgs/msg/PerceivedObjects"

Converter = Callable[[Any, AdapterConfig], ObjectArrays]


def _own(message: RecordList, _: AdapterConfig) -> ObjectArrays:
    return objects_from_records(message)


CONVERTERS: dict[str, Converter] = {
    OWN_TYPE: _own,
    "autoware_perception_msgs/msg/TrackedObjects": objects_from_tracked,
    "derived_object_msgs/msg/ObjectArray": objects_from_derived,
}


@dataclass(frozen=True)
class ObjectsAdapter:
    """Makes messages of one type into objects; its fields are parameters of the node."""

    objects_type: str = field(
        default=OWN_TYPE,
        metadata={"description": f"Type of the objects' messages: {', '.join(CONVERTERS)}"},
    )
    objects: AdapterConfig = field(default_factory=AdapterConfig)

    def __post_init__(self) -> None:
        if self.objects_type not in CONVERTERS:
            raise ConfigurationError(
                f"objects_type is {self.objects_type!r}, expected one of {', '.join(CONVERTERS)}"
            )

    def __call__(self, message: Any) -> ObjectArrays:  # noqa: ANN401
        """Return the objects of a message; the core checks them.

        Raises:
            InputError: an object makes no sense.
        """
        return CONVERTERS[self.objects_type](message, self.objects)

    @property
    def reader(self) -> RecordReader | None:
        """What reads the serialised messages; None where rclpy must, as for other stacks'."""
        return read_objects if self.objects_type == OWN_TYPE else None

    def message_type(self) -> type:
        """Return the class of the messages, to subscribe with.

        Raises:
            ConfigurationError: its package is not installed.
        """
        package, _, name = self.objects_type.split("/")
        try:
            found: type = getattr(importlib.import_module(f"{package}.msg"), name)
        except (ImportError, AttributeError) as error:
            apt_name = f"ros-$ROS_DISTRO-{package.replace('_', '-')}"
            raise ConfigurationError(
                f"objects of type {self.objects_type} need the package {package}, which is not "
                f"installed here: sudo apt install {apt_name}"
            ) from error
        return found
