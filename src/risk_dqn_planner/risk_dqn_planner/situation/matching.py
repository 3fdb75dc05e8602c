# SPDX-License-Identifier: Apache-2.0
"""Which perceived vehicles are on which intersecting lanes, and where along them."""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.geometry.polyline import project_kernel
from risk_dqn_planner.situation.inputs import ObjectArrays
from risk_dqn_planner.situation.paths import PathTable

NOT_ON_PATH = math.inf


@kernel
def turned_by_kernel(heading: float, reference: float) -> float:
    """Return the angle between two headings, 0 to pi [rad]."""
    turn = heading - reference
    return abs(math.atan2(math.sin(turn), math.cos(turn)))


@kernel
def in_footprint_kernel(
    x: float, y: float, at_x: float, at_y: float, heading: float, length: float, width: float
) -> bool:
    """Tell whether a point lies in a vehicle's rectangle about (at_x, at_y)."""
    cosine, sine = math.cos(heading), math.sin(heading)
    ahead = (x - at_x) * cosine + (y - at_y) * sine
    left = (y - at_y) * cosine - (x - at_x) * sine
    return abs(ahead) <= 0.5 * length and abs(left) <= 0.5 * width


@kernel
def distance_on_path_kernel(
    table: PathTable,
    p: int,
    x: float,
    y: float,
    heading: float,
    tolerance: float,
    turn: float,
    beyond: float,
) -> tuple[float, float]:
    """Return (distance to the zone's centre, lane heading), or infinity if not on path p.

    On the path means: the centre within the lane's half width plus `tolerance` [m], the heading
    within `turn` [rad], between the path's start and `beyond` [m] where vehicles cease to matter.
    """
    reach = table.half_width_m[p] + tolerance
    if x < table.box[p, 0] - reach or x > table.box[p, 2] + reach:
        return NOT_ON_PATH, 0.0
    if y < table.box[p, 1] - reach or y > table.box[p, 3] + reach:
        return NOT_ON_PATH, 0.0
    begin, end = table.first[p], table.first[p + 1]
    s, lateral, along = project_kernel(table.xy[begin:end], table.s[begin:end], x, y, heading, turn)
    # Written so that not-a-number is on no path.
    near = abs(lateral) <= reach and turned_by_kernel(heading, along) <= turn + 1e-9
    if near and s >= 0.0 and s <= table.end_m[p] + beyond:
        return table.zone_center_m[p] - s, along
    return NOT_ON_PATH, 0.0


@allocating_kernel
def match_kernel(
    table: PathTable,
    objects: ObjectArrays,
    tolerance: float,
    turn: float,
    usual_length: float,
    position_error: float,
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the C (vehicle, lane) pairs, in the order of the objects and then of the lanes.

    object index (C,), lane index (C,), distance to the zone's centre (C,) [m] and speed along
    the lane (C,) [m/s]. A vehicle that fits several ways through one lane counts once, on the
    way that brings it to the zone first. It counts until its rear has left the zone, also if its
    place is off by `position_error` [m] or it is longer than `usual_length` [m].
    """
    count = objects.x_m.shape[0]
    paths = table.lane.shape[0]
    room = count * paths
    who = np.empty(room, np.int64)
    lane = np.empty(room, np.int64)
    distance = np.empty(room)
    speed = np.empty(room)
    used = 0
    for i in range(count):
        first_of_object = used
        heading = objects.heading_rad[i]
        beyond = position_error + max(0.5 * (objects.length_m[i] - usual_length), 0.0)
        for p in range(paths):
            d, along = distance_on_path_kernel(
                table, p, objects.x_m[i], objects.y_m[i], heading, tolerance, turn, beyond
            )
            if d == NOT_ON_PATH:
                continue
            known = used > first_of_object and lane[used - 1] == table.lane[p]
            if known and distance[used - 1] <= d:
                continue
            if known:
                used -= 1
            who[used], lane[used], distance[used] = i, table.lane[p], d
            speed[used] = objects.speed_mps[i] * math.cos(heading - along)
            used += 1
    return who[:used], lane[:used], distance[:used], speed[:used]
