# SPDX-License-Identifier: Apache-2.0
"""Which way an object faces: every way that cannot be ruled out.

A vehicle that faces the wrong way is on no lane and would vanish. Trackers get the front and the
back of a vehicle wrong, and detectors may know no orientation at all. So an object becomes as
many vehicles at one place as there are ways it may face; those that fit no lane matter to nobody.
"""

import enum
import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from risk_dqn_planner.errors import InputError
from risk_dqn_planner.faults import FaultyInput, Status
from risk_dqn_planner.situation.inputs import ObjectArrays

# Faster than this (walking pace) something moves ahead, whatever its orientation says.
_MOVES_MPS = 1.0
# So far off its orientation an object may move; a vehicle's slip is far below.
_SLIP_RAD = math.radians(45.0)
# Orientations are normalised; an unset one has norm 0.
_NORM_TOLERANCE = 0.1


class Facing(enum.Enum):
    """How much is known of an orientation."""

    KNOWN = "known"
    SIGN_UNKNOWN = "front and back may be mixed up"
    UNKNOWN = "unknown"


class Yaw(NamedTuple):
    """Heading of an object's x axis [rad], and whether its orientation was given at all."""

    heading_rad: float
    given: bool


class Body(NamedTuple):
    """An object: its centre [m], heading [rad], velocity along the map's axes [m/s], size [m].

    assumed_mps: speed to assume in place of the velocity [m/s], where nobody has measured that.
    """

    id: int
    x_m: float
    y_m: float
    heading_rad: float
    facing: Facing
    vx_mps: float
    vy_mps: float
    length_m: float
    width_m: float
    assumed_mps: float | None = None


def malformed(text: str) -> InputError:
    """Return the error for an object of which a field means nothing."""
    return InputError(text, Status.MALFORMED_INPUT, FaultyInput.OBJECTS)


def yaw_of(quaternion: Any, name: str) -> Yaw:  # noqa: ANN401 (any stack's quaternion)
    """Return the heading of a quaternion; one of norm 0 was never set.

    Raises:
        InputError: it is no rotation.
    """
    x, y, z, w = (float(getattr(quaternion, axis)) for axis in "xyzw")
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if norm == 0.0:
        return Yaw(0.0, given=False)
    if not abs(norm - 1.0) <= _NORM_TOLERANCE:
        raise malformed(f"{name}: orientation has norm {norm:g}, expected 1")
    return Yaw(math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z), given=True)


def rotated(x: float, y: float, angle_rad: float) -> tuple[float, float]:
    """Return a vector turned counter-clockwise."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    return cosine * x - sine * y, sine * x + cosine * y


def ways(body: Body) -> list[tuple[float, float]]:
    """Return the (heading [rad], speed along it [m/s]) that an object may have, likeliest first."""
    if body.assumed_mps is not None:
        return [(heading, body.assumed_mps) for heading in _headings(body)]
    speed = math.hypot(body.vx_mps, body.vy_mps)
    course = math.atan2(body.vy_mps, body.vx_mps)
    moves = speed > _MOVES_MPS
    if body.facing is Facing.UNKNOWN:
        return [(course, speed)] if moves else [(heading, speed) for heading in _headings(body)]
    found = [(heading, speed * math.cos(course - heading)) for heading in _headings(body)]
    # Moving sideways or backwards: the orientation may be wrong. Not-a-number adds nothing.
    if moves and all(along < speed * math.cos(_SLIP_RAD) for _, along in found):
        found.append((course, speed))
    return found


def _headings(body: Body) -> list[float]:
    count = {Facing.KNOWN: 1, Facing.SIGN_UNKNOWN: 2, Facing.UNKNOWN: 4}[body.facing]
    return [body.heading_rad + k * math.tau / count for k in range(count)]


def vehicles(bodies: Iterable[Body], id_step: int) -> ObjectArrays:
    """Return objects as the planner knows them; further ways of one have `id_step` added each."""
    rows = [
        (body.id + k * id_step, body.x_m, body.y_m, *way, body.length_m, body.width_m)
        for body in bodies
        for k, way in enumerate(ways(body))
    ]
    table = np.array([row[1:] for row in rows], dtype=np.float64).reshape(-1, 6)
    ids = np.array([row[0] for row in rows], dtype=np.int64)
    return ObjectArrays(ids, *np.ascontiguousarray(table.T))
