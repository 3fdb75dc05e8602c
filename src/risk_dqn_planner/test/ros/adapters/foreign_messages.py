# SPDX-License-Identifier: Apache-2.0
"""Messages of other stacks with the fields that theirs have, as plain objects."""

import math
from collections.abc import Sequence
from types import SimpleNamespace as Fields

UUID = tuple(range(16))


def xyz(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Fields:
    return Fields(x=x, y=y, z=z)


def quaternion(yaw_rad: float) -> Fields:
    return Fields(x=0.0, y=0.0, z=math.sin(0.5 * yaw_rad), w=math.cos(0.5 * yaw_rad))


NO_ORIENTATION = Fields(x=0.0, y=0.0, z=0.0, w=0.0)


def pose(x: float, y: float, orientation: Fields) -> Fields:
    return Fields(position=xyz(x, y), orientation=orientation)


def twist(x: float, y: float) -> Fields:
    return Fields(linear=xyz(x, y), angular=xyz())


def polygon(*corners: tuple[float, float]) -> Fields:
    return Fields(points=[xyz(x, y) for x, y in corners])


def header(frame_id: str = "map") -> Fields:
    return Fields(stamp=Fields(sec=3, nanosec=0), frame_id=frame_id)


def tracked(
    at: tuple[float, float] = (0.0, 0.0),
    orientation: Fields | None = None,
    velocity: tuple[float, float] = (0.0, 0.0),
    *,
    available: int = 2,
    uuid: Sequence[int] = UUID,
    classes: Sequence[tuple[int, float]] = ((1, 1.0),),
    shape: int = 0,
    dimensions: tuple[float, float] = (4.5, 1.8),
    footprint: Sequence[tuple[float, float]] = (),
    existence: float = 1.0,
) -> Fields:
    """An autoware_perception_msgs/msg/TrackedObject; `velocity` in the object's own frame."""
    return Fields(
        object_id=Fields(uuid=uuid),
        existence_probability=existence,
        classification=[Fields(label=label, probability=p) for label, p in classes],
        kinematics=Fields(
            pose_with_covariance=Fields(pose=pose(*at, orientation or quaternion(0.0))),
            twist_with_covariance=Fields(twist=twist(*velocity)),
            orientation_availability=available,
            is_stationary=False,
        ),
        shape=Fields(type=shape, footprint=polygon(*footprint), dimensions=xyz(*dimensions, 1.5)),
    )


def tracked_list(*objects: Fields, frame_id: str = "map") -> Fields:
    return Fields(header=header(frame_id), objects=list(objects))


def derived(
    at: tuple[float, float] = (0.0, 0.0),
    orientation: Fields | None = None,
    velocity: tuple[float, float] = (0.0, 0.0),
    *,
    number: int = 7,
    level: int = 1,
    frame_id: str = "map",
    shape: int = 1,
    dimensions: Sequence[float] = (4.5, 1.8, 1.5),
    prism: Sequence[tuple[float, float]] = (),
    classified: bool = True,
    label: int = 6,
    certainty: int = 255,
) -> Fields:
    """A derived_object_msgs/msg/Object; `velocity` along the axes of the map."""
    return Fields(
        header=header(frame_id),
        id=number,
        detection_level=level,
        object_classified=classified,
        pose=pose(*at, orientation or quaternion(0.0)),
        twist=twist(*velocity),
        polygon=polygon(),
        shape=Fields(type=shape, dimensions=list(dimensions), polygon=polygon(*prism)),
        classification=label,
        classification_certainty=certainty,
        classification_age=1,
    )


def derived_list(*objects: Fields, frame_id: str = "map") -> Fields:
    return Fields(header=header(frame_id), objects=list(objects))
