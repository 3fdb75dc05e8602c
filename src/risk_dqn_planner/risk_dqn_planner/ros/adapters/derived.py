# SPDX-License-Identifier: Apache-2.0
"""derived_object_msgs/msg/ObjectArray: conventions and sources in docs/adapters.md.

Positions and velocities are in the frame of the header. Only fields are read, so that messages
of rclpy and of a bag reader do alike.
"""

from typing import Any

from risk_dqn_planner.errors import InputError
from risk_dqn_planner.faults import FaultyInput, Status
from risk_dqn_planner.ros.adapters.config import NOT_OBSTACLES, NOT_VEHICLES, NOTHING, AdapterConfig
from risk_dqn_planner.ros.adapters.footprints import NO_FOOTPRINT, Footprint, box_about
from risk_dqn_planner.ros.adapters.hypotheses import (
    Body,
    Facing,
    malformed,
    rotated,
    vehicles,
    yaw_of,
)
from risk_dqn_planner.situation.inputs import ObjectArrays

_DETECTED = 0
_PEDESTRIAN, _BARRIER, _SIGN = 4, 10, 11
_LEFT_OUT: dict[str, frozenset[int]] = {
    NOTHING: frozenset(),
    NOT_OBSTACLES: frozenset({_SIGN}),
    NOT_VEHICLES: frozenset({_SIGN, _PEDESTRIAN, _BARRIER}),
}
_MOST_CERTAIN = 255
_BOX, _SPHERE, _CYLINDER, _CONE, _PRISM = 1, 2, 3, 4, 5
_NEEDED = {_BOX: 3, _SPHERE: 1, _CYLINDER: 2, _CONE: 2}  # dimensions
# Ids have 32 bits; above them the way an object may face is counted.
_ID_STEP = 2**32


def objects_from_derived(message: Any, config: AdapterConfig) -> ObjectArrays:  # noqa: ANN401
    """Return the objects as arrays in the frame of the list's header; the core checks them.

    Raises:
        InputError: an object is in another frame, or an orientation or shape is none.
    """
    frame_id = message.header.frame_id
    kept = [item for item in message.objects if not _left_out(item, config)]
    for item in kept:
        own = item.header.frame_id
        if own not in ("", frame_id):
            text = f"object {item.id}: frame is {own!r}, expected {frame_id!r}"
            raise InputError(text, Status.WRONG_FRAME, FaultyInput.OBJECTS)
    return vehicles((_body(item, config) for item in kept), _ID_STEP)


def _left_out(item: Any, config: AdapterConfig) -> bool:  # noqa: ANN401
    certainty = int(item.classification_certainty) / _MOST_CERTAIN
    sure = bool(item.object_classified) and certainty >= config.min_certainty
    return sure and int(item.classification) in _LEFT_OUT[config.left_out]


def _body(item: Any, config: AdapterConfig) -> Body:  # noqa: ANN401
    name = f"object {item.id}"
    heading, given = yaw_of(item.pose.orientation, name)
    shape = _footprint(item.shape, name)
    x, y = rotated(shape.x_m, shape.y_m, heading)
    vx, vy = float(item.twist.linear.x), float(item.twist.linear.y)
    # Velocities of objects that are only detected are not to be relied on; 0 says nothing there.
    measured = int(item.detection_level) != _DETECTED or vx != 0.0 or vy != 0.0
    return Body(
        id=int(item.id),
        x_m=float(item.pose.position.x) + x,
        y_m=float(item.pose.position.y) + y,
        heading_rad=heading,
        facing=Facing.KNOWN if given else Facing.UNKNOWN,
        vx_mps=vx,
        vy_mps=vy,
        length_m=shape.length_m,
        width_m=shape.width_m,
        assumed_mps=None if measured else config.unknown_speed_mps,
    )


def _footprint(shape: Any, name: str) -> Footprint:  # noqa: ANN401
    """Return the box about a shape_msgs/msg/SolidPrimitive; all 0 where it was never set."""
    kind, sizes = int(shape.type), [float(size) for size in shape.dimensions]
    if kind == _PRISM:
        return box_about(shape.polygon.points)
    if kind not in _NEEDED:
        if not sizes:
            return NO_FOOTPRINT
        raise malformed(f"{name}: shape {kind}, expected 1 to 5")
    if len(sizes) < _NEEDED[kind]:
        raise malformed(f"{name}: {len(sizes)} dimensions, expected {_NEEDED[kind]}")
    if kind == _BOX:
        return Footprint(0.0, 0.0, sizes[0], sizes[1])
    # Spheres have a radius, cylinders and cones a height and then a radius.
    diameter = 2.0 * sizes[_NEEDED[kind] - 1]
    return Footprint(0.0, 0.0, diameter, diameter)
