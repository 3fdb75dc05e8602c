# SPDX-License-Identifier: Apache-2.0
"""Objects in bags of other stacks: read with the definitions of the bag, made into the own type.

The packages of these stacks are not needed. The conversion is the one of the situation node.
"""

from pathlib import Path
from typing import Any

from rclpy.serialization import serialize_message
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from risk_dqn_planner.errors import BagError, InputError
from risk_dqn_planner.ros.adapters.config import AdapterConfig
from risk_dqn_planner.ros.adapters.kinds import CONVERTERS, OWN_TYPE, ObjectsAdapter
from risk_dqn_planner.ros.conversions import objects_to_message, to_ns
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.foreign_types import FOREIGN_TYPES


def is_foreign(type_name: str) -> bool:
    """Tell whether objects of this type are another stack's that can be made into the own."""
    return type_name in CONVERTERS and type_name != OWN_TYPE


def types_of(connection: Connection) -> Typestore:
    """Return the types that a topic's messages are made of, as its bag defines them.

    Raises:
        TypesysError: the bag's definition makes no sense.
    """
    definition = connection.msgdef
    if definition.format is MessageDefinitionFormat.MSG:
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(definition.data, connection.msgtype))
    else:
        store = get_typestore(Stores.ROS2_JAZZY)
        text = FOREIGN_TYPES[connection.msgtype]
        known = get_types_from_msg(text, connection.msgtype)
        store.register({k: v for k, v in known.items() if k not in store.fielddefs})
    return store


class ForeignObjects:
    """Makes the serialised messages of a foreign topic into serialised messages of the own type."""

    def __init__(self, path: Path, connection: Connection, config: AdapterConfig) -> None:
        """Prepare for a topic of the bag at `path`, which errors name.

        Raises:
            BagError: the bag's definition of the type makes no sense.
        """
        self._path = path
        self._type = connection.msgtype
        self._adapter = ObjectsAdapter(self._type, config)
        try:
            self._types = types_of(connection)
        except TypesysError as error:
            raise BagError(f"{path}: the definition of {self._type} is damaged: {error}") from error

    def own(self, data: bytes) -> bytes:
        """Return the objects of a serialised message as a serialised PerceivedObjects.

        Raises:
            BagError: the message is damaged, of another version, or an object makes no sense.
        """
        try:
            message: Any = self._types.deserialize_cdr(data, self._type)
            objects = self._adapter(message)
        except SerdeError as error:
            raise BagError(f"{self._path} holds a damaged {self._type}: {error}") from error
        except AttributeError as error:
            raise BagError(
                f"{self._path} was recorded with another version of {self._type}: {error}"
            ) from error
        except InputError as error:
            time_s = to_ns(message.header.stamp) / SECOND_NS
            raise BagError(f"{self._path}: objects at {time_s:.3f} s: {error}") from error
        header = message.header
        return bytes(
            serialize_message(objects_to_message(objects, to_ns(header.stamp), header.frame_id))
        )
