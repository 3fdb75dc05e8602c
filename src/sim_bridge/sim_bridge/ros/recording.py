# SPDX-License-Identifier: Apache-2.0
"""Bags as Jazzy's rosbag2 writes and reads them (MCAP), without rosbag2 itself.

Messages stay serialised from the wire to the file. They are stored by the time in their header,
not by the time of their arrival, and in a fixed order, so the same episode gives the same bag.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Literal

from ament_index_python.packages import get_package_share_path
from rclpy.qos import DurabilityPolicy
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import (
    CompressionFormat,
    CompressionMode,
    Reader,
    ReaderError,
    StoragePlugin,
    Writer,
)
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from risk_dqn_planner.errors import BagError
from risk_dqn_planner.ros.adapters.config import AdapterConfig
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.foreign import ForeignObjects, is_foreign
from sim_bridge.ros.topics import OBJECTS, Topic

ALL_BAGS = Path("bags")
_INFINITE = QosTime(2147483647, 4294967295)


def bag_folder(named: Path, folder: Path = ALL_BAGS) -> Path:
    """Return a bag that is given by its path, or by its name in the folder of all bags.

    What is neither is returned as it is: who reads it says what is wrong.
    """
    beside = folder / named
    return beside if not named.exists() and beside.exists() else named


def no_bag(path: Path, folder: Path = ALL_BAGS) -> BagError:
    """Return the error about a path that holds no bag; it names those in the folder of all bags."""
    names = ", ".join(sorted(each.parent.name for each in folder.glob("*/metadata.yaml")))
    named = f", or one of {names}" if names else ""
    return BagError(f"{path} is no bag, expected a folder with metadata.yaml{named}")


@dataclass(frozen=True)
class Stored:
    """A serialised message of a topic; `data` is its CDR with the encapsulation header."""

    stamp_ns: int
    topic: str
    data: bytes


def stamp_of(data: bytes) -> int:
    """Nanoseconds in the header of a serialised message whose first field is a header."""
    order: Literal["little", "big"] = "little" if data[1] & 1 else "big"
    seconds = int.from_bytes(data[4:8], order, signed=True)
    return seconds * SECOND_NS + int.from_bytes(data[8:12], order)


def installed_types() -> Typestore:
    """Message types of Jazzy and of the intersection_msgs that is installed."""
    store = get_typestore(Stores.ROS2_JAZZY)
    package = "intersection_msgs"
    types = {}
    for file in sorted((get_package_share_path(package) / "msg").glob("*.msg")):
        types.update(get_types_from_msg(file.read_text("utf-8"), f"{package}/msg/{file.stem}"))
    store.register(types)
    return store


def _offered_qos(topic: Topic) -> Qos:
    latched = topic.qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=topic.qos.depth,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        deadline=_INFINITE,
        lifespan=_INFINITE,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=_INFINITE,
        avoid_ros_namespace_conventions=False,
    )


class BagWriter:
    """Writes one bag; a context manager."""

    def __init__(self, path: Path, topics: Sequence[Topic], notes: Mapping[str, str]) -> None:
        """Create the bag; `notes` (what was recorded) go into the custom data of its metadata.

        Raises:
            BagError: the path exists already.
        """
        if path.exists():
            raise BagError(f"{path} exists already, expected a place for a new bag")
        self._writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP)
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        for key, value in notes.items():
            self._writer.set_custom_data(key, value)
        self._writer.open()
        types = installed_types()
        self._ranks = {topic.name: rank for rank, topic in enumerate(topics)}
        self._connections = {
            topic.name: self._writer.add_connection(
                topic.name,
                topic.type_name,
                typestore=types,
                offered_qos_profiles=[_offered_qos(topic)],
            )
            for topic in topics
        }

    def write(self, messages: Sequence[Stored]) -> None:
        """Append messages, ordered by stamp and then by topic as listed."""
        for message in sorted(messages, key=lambda m: (m.stamp_ns, self._ranks[m.topic])):
            connection = self._connections[message.topic]
            self._writer.write(connection, message.stamp_ns, message.data)

    def close(self) -> None:
        """Complete the bag."""
        self._writer.close()

    def __enter__(self) -> "BagWriter":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


@dataclass(frozen=True)
class Bag:
    """A bag read into memory: its notes, and its messages by stamp."""

    path: Path
    notes: Mapping[str, str]
    messages: Sequence[Stored]

    def of(self, topic: Topic) -> list[Stored]:
        """Messages of one topic."""
        return [message for message in self.messages if message.topic == topic.name]


def _check_types(path: Path, connections: Sequence[Connection], names: Mapping[str, Topic]) -> None:
    types = installed_types()
    for name, topic in names.items():
        found = [c for c in connections if c.topic == name]
        if not found:
            raise BagError(f"{path} lacks the topic {name}")
        if topic is OBJECTS and is_foreign(found[0].msgtype):
            continue
        if found[0].msgtype != topic.type_name:
            raise BagError(f"{name} in {path} is {found[0].msgtype}, expected {topic.type_name}")
        if found[0].digest and found[0].digest != types.hash_rihs01(topic.type_name):
            raise BagError(
                f"{path} was recorded with another version of {topic.type_name}, record it anew"
            )


def read_bag(
    path: Path,
    topics: Sequence[Topic],
    adapters: AdapterConfig | None = None,
    names: Mapping[str, str] | None = None,
) -> Bag:
    """Read the given topics of a bag; objects of another stack's type are made into own ones.

    names: by the own name of a topic its name in the bag, where that differs.

    Raises:
        BagError: the bag is missing, unreadable, lacks a topic or has it with another type.
    """
    own = {(names or {}).get(topic.name, topic.name): topic for topic in topics}
    try:
        with Reader(path) as reader:
            _check_types(path, reader.connections, own)
            wanted = [c for c in reader.connections if c.topic in own]
            foreign = {
                c.id: ForeignObjects(path, c, adapters or AdapterConfig())
                for c in wanted
                if is_foreign(c.msgtype)
            }
            messages = [
                Stored(
                    stamp_ns,
                    own[connection.topic].name,
                    foreign[connection.id].own(data) if connection.id in foreign else bytes(data),
                )
                for connection, stamp_ns, data in reader.messages(wanted)
            ]
            custom = reader.storage.metadata.custom
    except FileNotFoundError as error:
        raise no_bag(path) from error
    except (ReaderError, OSError) as error:
        raise BagError(f"{path} cannot be read as a bag: {error}") from error
    return Bag(path, dict(custom or {}), messages)
