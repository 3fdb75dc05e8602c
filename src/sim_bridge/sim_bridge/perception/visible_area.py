# SPDX-License-Identifier: Apache-2.0
"""The visible area as a polygon, as a perception would report it."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry

from risk_dqn_planner.situation.situations import Floats

_DISC_POINTS = 256
# Far ends of shadows lie on an arc of this many pieces, well beyond the disc.
_ARC_PIECES = 16
_BEYOND = 1.5


def visible_polygon(x: float, y: float, range_m: float, obstacles: Sequence[Floats]) -> Floats:
    """Return the part (K, 2) of the disc about a sensor that no obstacle hides.

    obstacles: convex polygons (C, 2) that do not contain the sensor. The disc has 256 corners on
    its circle, so it is up to 1 cm short of a range of 70 m.
    """
    turn = np.linspace(0.0, 2.0 * math.pi, _DISC_POINTS, endpoint=False)
    disc = Polygon(np.column_stack((x + range_m * np.cos(turn), y + range_m * np.sin(turn))))
    shadows = [_shadow(x, y, range_m, corners) for corners in obstacles]
    seen = shapely.difference(disc, shapely.union_all(shadows))
    parts = getattr(seen, "geoms", [seen])
    # What is seen from one place hangs together; other parts are slivers of rounding.
    sensor = Point(x, y)
    nearest: Any = min(parts, key=lambda part: part.distance(sensor))
    return np.array(nearest.exterior.coords)[:-1]


def _shadow(x: float, y: float, range_m: float, corners: Floats) -> BaseGeometry:
    """Return the obstacle and what is hidden behind it, beyond the sensor's range."""
    relative = corners - (x, y)
    center = relative.mean(axis=0)
    bearing = math.atan2(center[1], center[0])
    turn = np.arctan2(relative[:, 1], relative[:, 0]) - bearing
    turn = (turn + math.pi) % (2.0 * math.pi) - math.pi
    furthest = max(range_m, float(np.hypot(*relative.T).max())) * _BEYOND
    arc = bearing + np.linspace(turn.min(), turn.max(), _ARC_PIECES + 1)
    far = np.column_stack((x + furthest * np.cos(arc), y + furthest * np.sin(arc)))
    first, last = corners[turn.argmin()], corners[turn.argmax()]
    # The quadrilateral of tangent points and far arc misses nothing but the near side, which
    # belongs to the obstacle.
    behind = Polygon(np.vstack((first, far, last)))
    return shapely.union(behind.buffer(0.0), Polygon(corners))
