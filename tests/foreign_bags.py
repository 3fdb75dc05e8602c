# SPDX-License-Identifier: Apache-2.0
"""Writes bags as other stacks record them; shares no code with what reads and converts them.

The definitions are written out here, constants and all, as a recorder would store them.
"""

import uuid
from collections.abc import Callable, Iterable
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

Message = Any  # rosbags makes the classes as it reads the definitions

TRACKED_OBJECTS = "autoware_perception_msgs/msg/TrackedObjects"
OBJECT_ARRAY = "derived_object_msgs/msg/ObjectArray"

DEFINITIONS = {
    "autoware_perception_msgs/msg/ObjectClassification": """
uint8 UNKNOWN = 0
uint8 CAR = 1
uint8 label
float32 probability
""",
    "autoware_perception_msgs/msg/Shape": """
uint8 BOUNDING_BOX=0
uint8 CYLINDER=1
uint8 POLYGON=2
uint8 type
geometry_msgs/Polygon footprint
geometry_msgs/Vector3 dimensions
""",
    "autoware_perception_msgs/msg/TrackedObjectKinematics": """
uint8 UNAVAILABLE=0
uint8 SIGN_UNKNOWN=1
uint8 AVAILABLE=2
geometry_msgs/PoseWithCovariance pose_with_covariance
geometry_msgs/TwistWithCovariance twist_with_covariance
geometry_msgs/AccelWithCovariance acceleration_with_covariance
uint8 orientation_availability
bool is_stationary
""",
    "autoware_perception_msgs/msg/TrackedObject": """
unique_identifier_msgs/UUID object_id
float32 existence_probability
ObjectClassification[] classification
TrackedObjectKinematics kinematics
Shape shape
""",
    TRACKED_OBJECTS: "std_msgs/Header header\nTrackedObject[] objects\n",
    "derived_object_msgs/msg/Object": """
std_msgs/Header header
uint32 id
uint8 detection_level
uint8 OBJECT_DETECTED=0
uint8 OBJECT_TRACKED=1
bool object_classified
geometry_msgs/Pose pose
geometry_msgs/Twist twist
geometry_msgs/Accel accel
geometry_msgs/Polygon polygon
shape_msgs/SolidPrimitive shape
uint8 classification
uint8 CLASSIFICATION_CAR=6
uint8 classification_certainty
uint32 classification_age
""",
    OBJECT_ARRAY: "std_msgs/Header header\nderived_object_msgs/Object[] objects\n",
}


def types() -> Typestore:
    store = get_typestore(Stores.ROS2_JAZZY)
    found: dict[str, Any] = {}
    for name, text in DEFINITIONS.items():
        found.update(get_types_from_msg(text, name))
    store.register(found)
    return store


TYPES = types()


def build(name: str, **fields: object) -> Message:
    return TYPES.types[name](**fields)


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Message:
    return build("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def pose(x: float, y: float, heading: float) -> Message:
    return build(
        "geometry_msgs/msg/Pose",
        position=build("geometry_msgs/msg/Point", x=x, y=y, z=0.7),
        orientation=build(
            "geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=sin(heading / 2), w=cos(heading / 2)
        ),
    )


def twist(x: float, y: float) -> Message:
    return build("geometry_msgs/msg/Twist", linear=vector(x, y), angular=vector())


def no_polygon() -> Message:
    return build("geometry_msgs/msg/Polygon", points=[])


def uuid_of(number: int) -> uuid.UUID:
    return uuid.uuid5(uuid.NAMESPACE_OID, str(number))


def tracked_objects(own: Message) -> Message:
    """A PerceivedObjects as Autoware would say it: velocities in each object's own frame."""
    covariance = np.zeros(36)
    return build(
        TRACKED_OBJECTS,
        header=own.header,
        objects=[
            build(
                "autoware_perception_msgs/msg/TrackedObject",
                object_id=build(
                    "unique_identifier_msgs/msg/UUID",
                    uuid=np.frombuffer(uuid_of(o.id).bytes, dtype=np.uint8),
                ),
                existence_probability=0.5,
                classification=[
                    build(
                        "autoware_perception_msgs/msg/ObjectClassification",
                        label=1,
                        probability=0.8,
                    )
                ],
                kinematics=build(
                    "autoware_perception_msgs/msg/TrackedObjectKinematics",
                    pose_with_covariance=build(
                        "geometry_msgs/msg/PoseWithCovariance",
                        pose=pose(o.x_m, o.y_m, o.heading_rad),
                        covariance=covariance,
                    ),
                    twist_with_covariance=build(
                        "geometry_msgs/msg/TwistWithCovariance",
                        twist=twist(o.speed_mps, 0.0),
                        covariance=covariance,
                    ),
                    acceleration_with_covariance=build(
                        "geometry_msgs/msg/AccelWithCovariance",
                        accel=build("geometry_msgs/msg/Accel", linear=vector(), angular=vector()),
                        covariance=covariance,
                    ),
                    orientation_availability=2,
                    is_stationary=False,
                ),
                shape=build(
                    "autoware_perception_msgs/msg/Shape",
                    type=0,
                    footprint=no_polygon(),
                    dimensions=vector(o.length_m, o.width_m, 1.5),
                ),
            )
            for o in own.objects
        ],
    )


def object_array(own: Message) -> Message:
    """A PerceivedObjects as CARLA's bridge would say it: velocities along the map's axes."""
    return build(
        OBJECT_ARRAY,
        header=own.header,
        objects=[
            build(
                "derived_object_msgs/msg/Object",
                header=own.header,
                id=o.id,
                detection_level=1,
                object_classified=True,
                pose=pose(o.x_m, o.y_m, o.heading_rad),
                twist=twist(o.speed_mps * cos(o.heading_rad), o.speed_mps * sin(o.heading_rad)),
                accel=build("geometry_msgs/msg/Accel", linear=vector(), angular=vector()),
                polygon=no_polygon(),
                shape=build(
                    "shape_msgs/msg/SolidPrimitive",
                    type=1,
                    dimensions=np.array([o.length_m, o.width_m, 1.5]),
                    polygon=no_polygon(),
                ),
                classification=6,
                classification_certainty=255,
                classification_age=3,
            )
            for o in own.objects
        ],
    )


KINDS: dict[str, Callable[[Message], Message]] = {
    TRACKED_OBJECTS: tracked_objects,
    OBJECT_ARRAY: object_array,
}


def header(stamp_ns: int, frame_id: str = "map") -> Message:
    stamp = build("builtin_interfaces/msg/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return build("std_msgs/msg/Header", stamp=stamp, frame_id=frame_id)


def write_bag(
    path: Path,
    messages: Iterable[tuple[int, str, str, bytes]],
    custom: dict[str, str],
    plugin: StoragePlugin = StoragePlugin.MCAP,
    *,
    own_types: Typestore | None = None,
) -> None:
    """Write (time of arrival, topic, type, serialised message) as other recorders do."""
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        for key, value in custom.items():
            writer.set_custom_data(key, value)
        connections: dict[str, Any] = {}
        for stamp_ns, topic, kind, data in messages:
            if topic not in connections:
                store = TYPES if kind in DEFINITIONS or own_types is None else own_types
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], stamp_ns, data)
