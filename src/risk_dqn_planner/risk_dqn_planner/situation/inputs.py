# SPDX-License-Identifier: Apache-2.0
"""What the planner perceives, as arrays in the map frame, and the checks each must pass."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from risk_dqn_planner.errors import InputError
from risk_dqn_planner.faults import FaultyInput, Status
from risk_dqn_planner.situation.situations import Floats, Integers

# No road vehicle is faster; whatever says so is a broken sensor.
MAX_SPEED_MPS = 100.0


class EgoPose(NamedTuple):
    """The ego: centre of its footprint [m], heading [rad], speed along the heading [m/s]."""

    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float


class ObjectArrays(NamedTuple):
    """N perceived vehicles, all (N,): ids, centres [m], headings [rad], speeds along them [m/s].

    length_m and width_m are 0 where unknown.
    """

    id: Integers
    x_m: Floats
    y_m: Floats
    heading_rad: Floats
    speed_mps: Floats
    length_m: Floats
    width_m: Floats


class Perception(NamedTuple):
    """What is perceived at one time, that of the objects; visible_area a simple polygon (K, 2) [m].

    visible_area_age_s: how much older than the objects the area is.
    """

    ego: EgoPose
    objects: ObjectArrays
    visible_area: Floats
    visible_area_age_s: float = 0.0


def object_arrays(
    rows: ArrayLike = (), ids: ArrayLike | None = None, size_m: tuple[float, float] = (0.0, 0.0)
) -> ObjectArrays:
    """Build from rows (N, 4) of x, y, heading, speed; ids default to 1, 2, ..., N."""
    table = np.asarray(rows, dtype=np.float64).reshape(-1, 4)
    count = len(table)
    x, y, heading, speed = (np.ascontiguousarray(column) for column in table.T)
    given = np.arange(1, count + 1) if ids is None else np.asarray(ids)
    return ObjectArrays(
        given.astype(np.int64),
        x,
        y,
        heading,
        speed,
        np.full(count, size_m[0]),
        np.full(count, size_m[1]),
    )


def check_ego(ego: EgoPose) -> None:
    """Raise InputError unless the ego's pose and speed are finite and plausible."""
    for name, value in zip(ego._fields, ego, strict=True):
        if not math.isfinite(value):
            text = f"ego: {name} is {value}, expected a finite number"
            raise InputError(text, Status.NOT_FINITE, FaultyInput.ODOMETRY)
    if abs(ego.speed_mps) > MAX_SPEED_MPS:
        text = f"ego: speed_mps is {ego.speed_mps:g}, expected at most {MAX_SPEED_MPS:g} in size"
        raise InputError(text, Status.IMPLAUSIBLE_SPEED, FaultyInput.ODOMETRY)


def check_objects(objects: ObjectArrays) -> None:
    """Raise InputError naming the first object that is not finite, not plausible or not unique."""
    for name, column in zip(objects._fields[1:], objects[1:], strict=True):
        broken = ~np.isfinite(column)
        if broken.any():
            raise _complaint(objects, broken, Status.NOT_FINITE, name, "a finite number")
    too_fast = np.abs(objects.speed_mps) > MAX_SPEED_MPS
    if too_fast.any():
        expected = f"at most {MAX_SPEED_MPS:g} in size"
        raise _complaint(objects, too_fast, Status.IMPLAUSIBLE_SPEED, "speed_mps", expected)
    for name in ("length_m", "width_m"):
        negative = getattr(objects, name) < 0.0
        if negative.any():
            raise _complaint(objects, negative, Status.INVALID_SIZE, name, "0 or more")
    ids, counts = np.unique(objects.id, return_counts=True)
    if (counts > 1).any():
        twice = int(np.argmax(counts > 1))
        text = f"objects: id {ids[twice]} appears {counts[twice]} times, expected once at most"
        raise InputError(text, Status.DUPLICATE_ID, FaultyInput.OBJECTS)


def check_visible_area(polygon: Floats) -> None:
    """Raise InputError unless a polygon (K, 2) has three points or more, all finite."""
    where = FaultyInput.VISIBLE_AREA
    if polygon.ndim != 2 or polygon.shape[1] != 2:
        text = f"visible area: shape {polygon.shape}, expected (K, 2)"
        raise InputError(text, Status.MALFORMED_INPUT, where)
    if len(polygon) < 3:
        text = f"visible area: {len(polygon)} points, expected at least 3"
        raise InputError(text, Status.INVALID_VISIBLE_AREA, where)
    finite = np.isfinite(polygon).all(axis=1)
    if not finite.all():
        k = int(np.argmin(finite))
        text = (
            f"visible area: point {k} is ({polygon[k, 0]}, {polygon[k, 1]}), "
            "expected finite numbers"
        )
        raise InputError(text, Status.NOT_FINITE, where)


def _complaint(
    objects: ObjectArrays, broken: np.ndarray, kind: Status, name: str, expected: str
) -> InputError:
    index = int(np.argmax(broken))
    value = getattr(objects, name)[index]
    text = f"object {objects.id[index]}: {name} is {value:g}, expected {expected}"
    return InputError(text, kind, FaultyInput.OBJECTS)
