# SPDX-License-Identifier: Apache-2.0
"""A Situation as it arrives: its lanes and vehicles as arrays, see records.py."""

from typing import Any, NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from intersection_msgs.msg import IntersectingLane, RelevantVehicle
from numpy.typing import NDArray
from std_msgs.msg import Header

from risk_dqn_planner.ros.records import Cursor, Layout

_LANES, _VEHICLES = Layout.of_records(IntersectingLane), Layout.of_records(RelevantVehicle)
_IDS = Layout(np.dtype(np.int64))


class SituationRecords(NamedTuple):
    """The fields of a Situation in their order; route, lanes, vehicles: arrays of any length."""

    header: Header
    status: int
    faulty_input: int
    status_text: str
    route: NDArray[Any]
    route_stamp: Time
    stop_line_distance_m: float
    stop_line_derived: bool
    goal_distance_m: float
    ego_speed_mps: float
    lanes: NDArray[Any]
    vehicles: NDArray[Any]


def read_situation(data: bytes) -> SituationRecords:
    """Return a serialised Situation.

    Raises:
        ValueError: it is encoded in another way, or ends too early.
    """
    cursor = Cursor(data)
    header = cursor.header()
    status, faulty_input = cursor.numbers("BB")
    status_text, route, route_stamp = cursor.text(), cursor.array(_IDS), cursor.time()
    (stop_line_distance_m,) = cursor.numbers("d")
    (stop_line_derived,) = cursor.numbers("?")
    goal_distance_m, ego_speed_mps = cursor.numbers("dd")
    return SituationRecords(
        header,
        status,
        faulty_input,
        status_text,
        route,
        route_stamp,
        stop_line_distance_m,
        stop_line_derived,
        goal_distance_m,
        ego_speed_mps,
        cursor.array(_LANES),
        cursor.array(_VEHICLES),
    )
