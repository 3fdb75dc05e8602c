# SPDX-License-Identifier: Apache-2.0
"""A list of numbers that is read at once is the list that rclpy reads one by one."""

import math
import struct

import numpy as np
import pytest
from geometry_msgs.msg import Point32, Polygon, PolygonStamped, Quaternion
from hypothesis import given
from hypothesis import strategies as st
from intersection_msgs.msg import (
    IntersectingLane,
    PerceivedObject,
    PerceivedObjects,
    RelevantVehicle,
    Situation,
)
from rclpy.serialization import deserialize_message, serialize_message

from risk_dqn_planner.ros.conversions import header, read_area, read_objects, to_stamp
from risk_dqn_planner.ros.records import RecordReader
from risk_dqn_planner.ros.situation_records import read_situation

numbers = st.floats(width=32)
identities = st.integers(-(2**63), 2**63 - 1)
# Names of every length modulo 4 and 8, on which what follows is aligned.
frames = st.sampled_from(("", "m", "ma", "map", "map4", "map/a", "karte ü", "a_long_name"))
stamps = st.integers(-(2**31) * 10**9, 2**31 * 10**9 - 1)


def same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other))


@given(st.lists(st.tuples(numbers, numbers), max_size=5), frames, stamps)
def test_corners_come_out_as_they_went_in(
    corners: list[tuple[float, float]], frame_id: str, stamp_ns: int
) -> None:
    message = PolygonStamped(header=header(stamp_ns, frame_id))
    message.polygon = Polygon(points=[Point32(x=x, y=y) for x, y in corners])
    received = read_area.of(message)
    assert received.header == message.header
    rows = zip(received.column("x").tolist(), received.column("y").tolist(), strict=True)
    pairs = list(zip(rows, corners, strict=True))
    assert all(same(x, a) and same(y, b) for (x, y), (a, b) in pairs)


@given(st.lists(st.tuples(identities, numbers, numbers), max_size=5), frames)
def test_objects_come_out_as_they_went_in(
    rows: list[tuple[int, float, float]], frame_id: str
) -> None:
    objects = [PerceivedObject(id=number, x_m=x, width_m=w) for number, x, w in rows]
    received = read_objects.of(PerceivedObjects(header=header(7, frame_id), objects=objects))
    assert received.header.frame_id == frame_id
    assert received.column("id", np.int64).tolist() == [number for number, _, _ in rows]
    for name, place in (("x_m", 1), ("width_m", 2)):
        found = received.column(name).tolist()
        assert all(same(a, row[place]) for a, row in zip(found, rows, strict=True))


def test_a_computer_that_writes_the_other_way_round_is_understood() -> None:
    # Encapsulation, stamp, "map" with its zero, number of corners, then x, y, z of each.
    parts = (b"\0\0\0\0", struct.pack(">iI", -2, 5), struct.pack(">I4s", 4, b"map\0"))
    data = b"".join((*parts, struct.pack(">I", 2), struct.pack(">6f", 1.5, -2.0, 0.0, 3.0, 4.0, 0)))
    received = read_area(data)
    assert (received.header.stamp.sec, received.header.stamp.nanosec) == (-2, 5)
    assert received.header.frame_id == "map"
    assert received.column("x").tolist() == [1.5, 3.0]
    assert received.column("y").tolist() == [-2.0, 4.0]


def test_a_message_that_ends_too_early_is_refused_wherever_it_ends() -> None:
    whole = bytes(serialize_message(PerceivedObjects(objects=[PerceivedObject(id=1)])))
    for length in range(len(whole)):
        with pytest.raises(ValueError, match=r"expected 0000 or 0001|too early|smaller|offset"):
            read_objects(whole[:length])


def test_a_message_that_is_encoded_in_another_way_is_refused() -> None:
    with pytest.raises(ValueError, match="a message is encoded as 0007, expected 0000 or 0001"):
        read_area(b"\0\7" + bytes(20))


class Padded:
    """Stands for the class of a message, as far as its layout goes."""

    @staticmethod
    def get_fields_and_field_types() -> dict[str, str]:
        return {"distance_m": "double", "kind": "uint8"}


class Misaligned:
    """Its first field may begin where its second may not."""

    @staticmethod
    def get_fields_and_field_types() -> dict[str, str]:
        return {"kind": "uint8", "distance_m": "double"}


def test_only_records_of_numbers_can_be_read_at_once() -> None:
    assert RecordReader(Quaternion)
    with pytest.raises(ValueError, match=r"Situation has fields of .*string.*, not numbers"):
        RecordReader(Situation)


@pytest.mark.parametrize("record", [Padded, Misaligned])
def test_records_that_lie_elsewhere_in_memory_than_on_the_wire_are_refused(record: type) -> None:
    with pytest.raises(ValueError, match=f"{record.__name__} begins or ends with a field"):
        RecordReader(record)


lanes = st.builds(
    IntersectingLane, lane_id=identities, kind=st.integers(0, 255), zone_m=numbers,
    speed_limit_mps=numbers,
)  # fmt: skip
vehicles = st.builds(RelevantVehicle, vehicle_id=identities, lane_id=identities, speed_mps=numbers)
situations = st.builds(
    Situation,
    header=st.builds(header, stamps, frames),
    status=st.integers(0, 255),
    faulty_input=st.integers(0, 255),
    status_text=frames,
    route=st.lists(identities, max_size=4),
    route_stamp=st.builds(to_stamp, stamps),
    stop_line_distance_m=numbers,
    stop_line_derived=st.booleans(),
    goal_distance_m=numbers,
    ego_speed_mps=numbers,
    lanes=st.lists(lanes, max_size=3),
    vehicles=st.lists(vehicles, max_size=5),
)


@given(situations)
def test_a_situation_is_read_as_rclpy_reads_it(sent: Situation) -> None:
    data = bytes(serialize_message(sent))
    read, expected = read_situation(data), deserialize_message(data, Situation)
    assert set(read._fields) == set(expected.get_fields_and_field_types())
    for name, value in zip(read._fields, read, strict=True):
        known = getattr(expected, name)
        if name in ("lanes", "vehicles"):
            for k, record in enumerate(known):
                assert value.dtype.names == tuple(record.get_fields_and_field_types())
                for column in value.dtype.names:
                    assert same(value[k][column], getattr(record, column)), column
            assert len(value) == len(known)
        elif name == "route":
            assert value.tolist() == known.tolist()
        else:
            assert value == known or same(value, known), name


def test_a_situation_that_ends_too_early_is_refused_wherever_it_ends() -> None:
    lanes, vehicles = [IntersectingLane(lane_id=3)], [RelevantVehicle(lane_id=3)]
    sent = Situation(route=[1, 2], status_text="what", lanes=lanes, vehicles=vehicles)
    whole = bytes(serialize_message(sent))
    for length in range(len(whole)):
        with pytest.raises(ValueError, match=r"expected 0000 or 0001|too early|smaller|offset"):
            read_situation(whole[:length])
