# SPDX-License-Identifier: Apache-2.0
"""The box about a shape, along the axes of the object."""

from collections.abc import Sequence
from typing import Any, NamedTuple


class Footprint(NamedTuple):
    """A box in the object's frame: its centre, length along x and width along y [m]."""

    x_m: float
    y_m: float
    length_m: float
    width_m: float


NO_FOOTPRINT = Footprint(0.0, 0.0, 0.0, 0.0)


def box_about(points: Sequence[Any]) -> Footprint:
    """Return the box about points that have x and y; all 0, unknown, where there are none."""
    if len(points) == 0:
        return NO_FOOTPRINT
    xs, ys = [float(p.x) for p in points], [float(p.y) for p in points]
    low_x, high_x, low_y, high_y = min(xs), max(xs), min(ys), max(ys)
    return Footprint(0.5 * (low_x + high_x), 0.5 * (low_y + high_y), high_x - low_x, high_y - low_y)
