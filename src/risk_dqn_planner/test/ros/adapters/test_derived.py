# SPDX-License-Identifier: Apache-2.0
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from foreign_messages import NO_ORIENTATION, Fields, derived, derived_list, quaternion

from risk_dqn_planner.errors import InputError
from risk_dqn_planner.ros.adapters.config import AdapterConfig
from risk_dqn_planner.ros.adapters.derived import objects_from_derived
from risk_dqn_planner.situation.inputs import ObjectArrays, check_objects

NORTH = math.pi / 2
DETECTED, TRACKED = 0, 1
BOX, SPHERE, CYLINDER, CONE, PRISM = 1, 2, 3, 4, 5
PEDESTRIAN, CAR, BARRIER, SIGN = 4, 6, 10, 11


def convert(*objects: Fields, **config: object) -> ObjectArrays:
    return objects_from_derived(derived_list(*objects), AdapterConfig(**config))


def ways(objects: ObjectArrays) -> list[tuple[float, float]]:
    pairs = zip(objects.heading_rad, objects.speed_mps, strict=True)
    return [(round(math.degrees(h), 6) % 360.0, round(v, 6)) for h, v in pairs]


def test_a_velocity_along_the_maps_axes_is_turned_onto_the_heading() -> None:
    objects = convert(derived((10.0, -5.0), quaternion(NORTH), (0.0, 6.0), number=2**32 - 1))
    assert objects.id[0] == 2**32 - 1
    assert (objects.x_m[0], objects.y_m[0]) == (10.0, -5.0)
    # Were the velocity read in the vehicle's frame, it would slide sideways.
    assert ways(objects) == [(90.0, 6.0)]


def test_a_diagonal_velocity_keeps_its_size() -> None:
    objects = convert(derived((0.0, 0.0), quaternion(math.atan2(3.0, 4.0)), (4.0, 3.0)))
    assert objects.speed_mps[0] == pytest.approx(5.0)


def test_a_vehicle_that_moves_against_its_heading_may_face_either_way() -> None:
    objects = convert(derived((0.0, 0.0), quaternion(NORTH), (0.0, -4.0)))
    assert ways(objects) == [(90.0, -4.0), (270.0, 4.0)]
    assert list(objects.id) == [7, 7 + 2**32]
    check_objects(objects)


def test_a_tracked_vehicle_that_stands_stands() -> None:
    assert ways(convert(derived(velocity=(0.0, 0.0), level=TRACKED))) == [(0.0, 0.0)]


def test_a_detected_one_whose_speed_nobody_measured_comes_at_the_limit() -> None:
    unmeasured = derived(velocity=(0.0, 0.0), level=DETECTED)
    assert ways(convert(unmeasured)) == [(0.0, 7.0)]
    assert ways(convert(unmeasured, unknown_speed_mps=0.0)) == [(0.0, 0.0)]


def test_a_detected_one_that_has_a_velocity_is_believed() -> None:
    # Sources that never set the level, such as CARLA's bridge, do fill the velocity.
    assert ways(convert(derived(velocity=(2.0, 0.0), level=DETECTED))) == [(0.0, 2.0)]


def test_without_orientation_it_may_face_anywhere() -> None:
    objects = convert(derived(orientation=NO_ORIENTATION, level=DETECTED))
    assert ways(objects) == [(0.0, 7.0), (90.0, 7.0), (180.0, 7.0), (270.0, 7.0)]
    check_objects(objects)


@pytest.mark.parametrize(
    ("shape", "dimensions", "expected"),
    [
        (BOX, (12.0, 2.5, 3.0), (12.0, 2.5)),
        (SPHERE, (0.5,), (1.0, 1.0)),
        (CYLINDER, (1.8, 0.3), (0.6, 0.6)),  # height, radius
        (CONE, (1.0, 0.25), (0.5, 0.5)),
        (0, (), (0.0, 0.0)),
    ],
)
def test_shapes_give_length_and_width(
    shape: int, dimensions: Sequence[float], expected: tuple[float, float]
) -> None:
    objects = convert(derived(shape=shape, dimensions=dimensions))
    assert (objects.length_m[0], objects.width_m[0]) == expected


def test_a_prism_has_the_box_about_its_base() -> None:
    prism = derived(shape=PRISM, dimensions=(1.0,), prism=((-2, -1), (2, -1), (2, 1)))
    objects = convert(prism)
    assert (objects.length_m[0], objects.width_m[0]) == (4.0, 2.0)


@pytest.mark.parametrize(
    ("classified", "label", "certainty", "left_out", "count"),
    [
        (True, CAR, 255, "not_vehicles", 1),
        (True, SIGN, 255, "not_obstacles", 0),
        (True, SIGN, 255, "nothing", 1),
        (False, SIGN, 255, "not_obstacles", 1),  # the class only counts where it is one
        (True, SIGN, 200, "not_obstacles", 1),  # 200 / 255 = 0.78
        (True, PEDESTRIAN, 255, "not_obstacles", 1),
        (True, PEDESTRIAN, 230, "not_vehicles", 0),  # 230 / 255 = 0.902
        (True, BARRIER, 255, "not_vehicles", 0),
        (True, 99, 255, "not_vehicles", 1),
    ],
)
def test_only_what_is_surely_no_vehicle_is_left_out(
    classified: bool, label: int, certainty: int, left_out: str, count: int
) -> None:
    item = derived(classified=classified, label=label, certainty=certainty)
    assert len(convert(item, left_out=left_out).id) == count


@pytest.mark.parametrize(
    ("broken", "complaint"),
    [
        (derived(frame_id="velodyne"), "object 7: frame is 'velodyne', expected 'map'"),
        (derived(shape=BOX, dimensions=(4.0, 2.0)), "object 7: 2 dimensions, expected 3"),
        (derived(shape=8), "object 7: shape 8"),
        (derived(orientation=Fields(x=0.0, y=0.0, z=0.0, w=0.5)), "object 7: orientation"),
    ],
)
def test_what_cannot_be_is_refused_by_the_name_of_its_object(
    broken: Fields, complaint: str
) -> None:
    with pytest.raises(InputError, match=complaint):
        convert(broken)


def test_objects_without_a_frame_of_their_own_are_in_that_of_the_list() -> None:
    assert len(convert(derived(frame_id="")).id) == 1


def test_not_a_number_reaches_the_check_that_refuses_it() -> None:
    for broken in (derived((math.nan, 0.0)), derived(velocity=(math.nan, 0.0))):
        with pytest.raises(InputError, match="object 7"):
            check_objects(convert(broken))
