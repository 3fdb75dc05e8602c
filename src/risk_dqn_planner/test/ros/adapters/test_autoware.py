# SPDX-License-Identifier: Apache-2.0
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent))

from foreign_messages import NO_ORIENTATION, Fields, quaternion, tracked, tracked_list

from risk_dqn_planner.errors import InputError
from risk_dqn_planner.faults import FaultyInput, Status
from risk_dqn_planner.ros.adapters.autoware import id_of_uuid, objects_from_tracked
from risk_dqn_planner.ros.adapters.config import AdapterConfig
from risk_dqn_planner.situation.inputs import ObjectArrays, check_objects

NORTH, WEST = math.pi / 2, math.pi
PEDESTRIAN, UNDER_DRIVABLE, UNKNOWN, CAR = 7, 11, 0, 1


def convert(*objects: Fields, **config: object) -> ObjectArrays:
    return objects_from_tracked(tracked_list(*objects), AdapterConfig(**config))


def ways(objects: ObjectArrays) -> list[tuple[float, float]]:
    """(heading in degrees, 0 to 360; speed), rounded."""
    degrees = np.degrees(objects.heading_rad) % 360.0
    return [
        (round(h, 6) % 360.0, round(v, 6)) for h, v in zip(degrees, objects.speed_mps, strict=True)
    ]


def test_a_velocity_in_the_objects_own_frame_is_the_speed_along_its_heading() -> None:
    objects = convert(tracked((10.0, -5.0), quaternion(NORTH), (6.0, 0.0)))
    assert (objects.x_m[0], objects.y_m[0]) == (10.0, -5.0)
    # Were the velocity read along the map's axes, a vehicle facing north would stand still.
    assert ways(objects) == [(90.0, 6.0)]
    assert (objects.length_m[0], objects.width_m[0]) == (4.5, 1.8)


def test_the_slip_of_a_turning_vehicle_does_not_turn_it() -> None:
    # 5 m/s ahead and 1 m/s sideways: 11 degrees of slip.
    assert ways(convert(tracked((0.0, 0.0), quaternion(NORTH), (5.0, 1.0)))) == [(90.0, 5.0)]


def test_a_vehicle_that_moves_backwards_may_have_been_turned_around_by_its_tracker() -> None:
    objects = convert(tracked((0.0, 0.0), quaternion(NORTH), (-4.0, 0.0)))
    assert ways(objects) == [(90.0, -4.0), (270.0, 4.0)]
    check_objects(objects)  # the two have different ids


def test_slow_reversing_is_believed() -> None:
    assert ways(convert(tracked((0.0, 0.0), quaternion(0.0), (-0.9, 0.0)))) == [(0.0, -0.9)]


def test_a_vehicle_that_moves_sideways_may_face_where_it_goes() -> None:
    objects = convert(tracked((0.0, 0.0), quaternion(0.0), (0.0, 3.0)))
    assert ways(objects) == [(0.0, 0.0), (90.0, 3.0)]


@pytest.mark.parametrize(("speed", "ahead"), [(0.0, 0.0), (5.0, 5.0), (-5.0, -5.0)])
def test_where_front_and_back_may_be_mixed_up_both_are_reported(speed: float, ahead: float) -> None:
    objects = convert(tracked((0.0, 0.0), quaternion(NORTH), (speed, 0.0), available=1))
    assert ways(objects) == [(90.0, ahead), (270.0, -ahead)]
    check_objects(objects)


@pytest.mark.parametrize("available", [0, 2])
def test_something_that_stands_without_orientation_may_face_anywhere(available: int) -> None:
    objects = convert(tracked((0.0, 0.0), NO_ORIENTATION, (0.5, 0.0), available=available))
    assert ways(objects) == [(0.0, 0.5), (90.0, 0.5), (180.0, 0.5), (270.0, 0.5)]
    check_objects(objects)


def test_something_that_moves_without_orientation_faces_where_it_goes() -> None:
    objects = convert(tracked((0.0, 0.0), NO_ORIENTATION, (-3.0, 4.0), available=0))
    assert ways(objects) == [(round(math.degrees(math.atan2(4.0, -3.0)), 6), 5.0)]


@given(st.floats(-math.pi, math.pi), st.sampled_from([0, 1, 2]), st.floats(-20.0, 20.0))
def test_no_lane_turns_a_vehicle_away_whose_orientation_is_in_doubt(
    lane_rad: float, available: int, ahead: float
) -> None:
    """One of the ways is within 60 degrees of the lane along which the vehicle really moves."""
    turned = quaternion(lane_rad if ahead >= 0.0 else lane_rad + math.pi)
    objects = convert(tracked((0.0, 0.0), turned, (ahead, 0.0), available=available))
    if abs(ahead) > 1.0 or available != 2:
        off = np.abs((objects.heading_rad - lane_rad + np.pi) % (2.0 * np.pi) - np.pi)
        assert off.min() < math.radians(60.0)
        assert objects.speed_mps[np.argmin(off)] == pytest.approx(abs(ahead))


@pytest.mark.parametrize(
    ("shape", "dimensions", "footprint", "expected"),
    [
        (0, (12.0, 2.5), (), (10.0, 20.0, 12.0, 2.5)),
        (1, (0.8, 0.8), (), (10.0, 20.0, 0.8, 0.8)),
        # From 1 m behind the pose to 3 m ahead: facing north, the centre lies 1 m further north.
        (2, (0.0, 0.0), ((-1, -1), (3, -1), (3, 1), (-1, 1)), (10.0, 21.0, 4.0, 2.0)),
        (2, (0.0, 0.0), (), (10.0, 20.0, 0.0, 0.0)),
    ],
    ids=["box", "cylinder by its diameter", "polygon", "empty polygon"],
)
def test_shapes_give_centre_and_size(
    shape: int,
    dimensions: tuple[float, float],
    footprint: tuple[tuple[float, float], ...],
    expected: tuple[float, ...],
) -> None:
    objects = convert(
        tracked(
            (10.0, 20.0), quaternion(NORTH), shape=shape, dimensions=dimensions, footprint=footprint
        )
    )
    found = (objects.x_m[0], objects.y_m[0], objects.length_m[0], objects.width_m[0])
    assert found == pytest.approx(expected)


def test_the_same_uuid_has_the_same_id_in_every_process() -> None:
    # blake2b of bytes 0 to 15, its first 8 bytes, modulo 2^61.
    assert id_of_uuid(range(16)) == id_of_uuid(np.arange(16, dtype=np.uint8))
    assert id_of_uuid(range(16)) == 0xF496_4486_7B08_97EA % 2**61


def test_uuids_that_differ_in_any_single_byte_have_different_ids() -> None:
    # Some sources count in one byte only, others repeat one byte sixteen times.
    counted = [[0] * k + [n] + [0] * (15 - k) for k in range(16) for n in range(1, 256)]
    repeated = [[n] * 16 for n in range(256)]
    ids = [id_of_uuid(uuid) for uuid in counted + repeated]
    assert len(set(ids)) == len(ids)
    assert all(0 <= number < 2**61 for number in ids)


def test_a_uuid_that_appears_twice_is_refused_and_not_merged() -> None:
    with pytest.raises(InputError, match="appears 2 times"):
        check_objects(convert(tracked((0.0, 0.0)), tracked((50.0, 0.0))))


@pytest.mark.parametrize(
    ("classes", "left_out", "count"),
    [
        ((), "not_vehicles", 1),
        (((UNKNOWN, 1.0),), "not_vehicles", 1),
        (((PEDESTRIAN, 1.0),), "not_obstacles", 1),
        (((PEDESTRIAN, 1.0),), "not_vehicles", 0),
        (((PEDESTRIAN, 0.89),), "not_vehicles", 1),
        (((PEDESTRIAN, 0.95), (CAR, 0.5)), "not_vehicles", 1),
        (((PEDESTRIAN, math.nan),), "not_vehicles", 1),
        (((UNDER_DRIVABLE, 0.95),), "not_obstacles", 0),
        (((UNDER_DRIVABLE, 0.95),), "nothing", 1),
        (((UNDER_DRIVABLE, 0.5), (UNKNOWN, 0.5)), "not_obstacles", 1),
    ],
)
def test_only_what_is_surely_no_vehicle_is_left_out(
    classes: tuple[tuple[int, float], ...], left_out: str, count: int
) -> None:
    assert len(convert(tracked(classes=classes), left_out=left_out).id) == count


@pytest.mark.parametrize("existence", [0.0, 0.05, math.nan])
def test_an_object_that_hardly_exists_counts_all_the_same(existence: float) -> None:
    assert len(convert(tracked(existence=existence)).id) == 1


@pytest.mark.parametrize(
    ("broken", "complaint"),
    [
        (tracked(orientation=Fields(x=0.0, y=0.0, z=0.0, w=2.0)), "orientation has norm 2"),
        (tracked(orientation=Fields(x=0.0, y=0.0, z=math.nan, w=1.0)), "orientation has norm nan"),
        (tracked(shape=9), "shape 9"),
        (tracked(available=3), "orientation_availability is 3"),
    ],
)
def test_what_cannot_be_is_refused_by_the_name_of_its_object(
    broken: Fields, complaint: str
) -> None:
    with pytest.raises(InputError, match=complaint) as refused:
        convert(broken)
    assert str(id_of_uuid(range(16))) in str(refused.value)
    assert refused.value.kind is Status.MALFORMED_INPUT
    assert refused.value.source is FaultyInput.OBJECTS


@pytest.mark.parametrize(
    "broken",
    [
        tracked((math.nan, 0.0)),
        tracked(velocity=(math.inf, 0.0)),
        tracked(velocity=(0.0, math.nan)),
        tracked(velocity=(150.0, 0.0)),
        tracked(dimensions=(-1.0, 2.0)),
    ],
)
def test_numbers_that_make_no_sense_reach_the_check_that_refuses_them(broken: Fields) -> None:
    with pytest.raises(InputError):
        check_objects(convert(broken))


def test_an_empty_list_is_no_vehicle() -> None:
    assert len(convert().id) == 0
