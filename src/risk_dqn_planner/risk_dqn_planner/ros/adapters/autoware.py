# SPDX-License-Identifier: Apache-2.0
"""autoware_perception_msgs/msg/TrackedObjects: conventions and sources in docs/adapters.md.

Velocities are in each object's own frame, positions in that of the header, dimensions are full
lengths. Only fields are read, so that messages of rclpy and of a bag reader do alike.
"""

import hashlib
from collections.abc import Sequence
from typing import Any

from risk_dqn_planner.ros.adapters.config import NOT_OBSTACLES, NOT_VEHICLES, NOTHING, AdapterConfig
from risk_dqn_planner.ros.adapters.footprints import Footprint, box_about
from risk_dqn_planner.ros.adapters.hypotheses import (
    Body,
    Facing,
    malformed,
    rotated,
    vehicles,
    yaw_of,
)
from risk_dqn_planner.situation.inputs import ObjectArrays

_FACING = {0: Facing.UNKNOWN, 1: Facing.SIGN_UNKNOWN, 2: Facing.KNOWN}
_BOUNDING_BOX, _CYLINDER, _POLYGON = 0, 1, 2
_PEDESTRIAN, _ANIMAL, _OVER_DRIVABLE, _UNDER_DRIVABLE = 7, 8, 10, 11
_LEFT_OUT: dict[str, frozenset[int]] = {
    NOTHING: frozenset(),
    NOT_OBSTACLES: frozenset({_OVER_DRIVABLE, _UNDER_DRIVABLE}),
    NOT_VEHICLES: frozenset({_OVER_DRIVABLE, _UNDER_DRIVABLE, _PEDESTRIAN, _ANIMAL}),
}
# Ids are 61 bits of a hash; above them the way an object may face is counted.
_ID_STEP = 2**61


def id_of_uuid(uuid: Sequence[int]) -> int:
    """Return the id that stands for a UUID (16 bytes): the same in every process, 0 to 2^61 - 1.

    A hash, because a part of the UUID would not do: some sources only fill a few of its bytes.
    """
    digest = hashlib.blake2b(bytes(uuid), digest_size=8).digest()
    return int.from_bytes(digest, "big") % _ID_STEP


def objects_from_tracked(message: Any, config: AdapterConfig) -> ObjectArrays:  # noqa: ANN401
    """Return the objects as arrays in the frame of the header; the core checks them.

    Raises:
        InputError: an orientation, shape or orientation_availability is none.
    """
    kept = (item for item in message.objects if not _left_out(item.classification, config))
    return vehicles((_body(item) for item in kept), _ID_STEP)


def _left_out(classification: Sequence[Any], config: AdapterConfig) -> bool:
    labels = _LEFT_OUT[config.left_out]
    weights = [(int(c.label) in labels, max(float(c.probability), 0.0)) for c in classification]
    certainty = sum(weight for out, weight in weights if out)
    # Whatever else it may be counts against it; not-a-number is no certainty.
    return certainty >= config.min_certainty * max(1.0, sum(weight for _, weight in weights))


def _body(item: Any) -> Body:  # noqa: ANN401
    kinematics = item.kinematics
    number = id_of_uuid(item.object_id.uuid)
    name = f"object {number}"
    pose = kinematics.pose_with_covariance.pose
    twist = kinematics.twist_with_covariance.twist.linear
    availability = int(kinematics.orientation_availability)
    if availability not in _FACING:
        raise malformed(f"{name}: orientation_availability is {availability}, expected 0, 1 or 2")
    heading, given = yaw_of(pose.orientation, name)
    shape = _footprint(item.shape, name)
    x, y = rotated(shape.x_m, shape.y_m, heading)
    vx, vy = rotated(float(twist.x), float(twist.y), heading)
    return Body(
        id=number,
        x_m=float(pose.position.x) + x,
        y_m=float(pose.position.y) + y,
        heading_rad=heading,
        facing=_FACING[availability] if given else Facing.UNKNOWN,
        vx_mps=vx,
        vy_mps=vy,
        length_m=shape.length_m,
        width_m=shape.width_m,
    )


def _footprint(shape: Any, name: str) -> Footprint:  # noqa: ANN401
    kind = int(shape.type)
    if kind in (_BOUNDING_BOX, _CYLINDER):
        return Footprint(0.0, 0.0, float(shape.dimensions.x), float(shape.dimensions.y))
    if kind != _POLYGON:
        raise malformed(f"{name}: shape {kind}, expected 0 (box), 1 (cylinder) or 2 (polygon)")
    return box_about(shape.footprint.points)
