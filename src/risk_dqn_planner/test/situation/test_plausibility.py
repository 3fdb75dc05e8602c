# SPDX-License-Identifier: Apache-2.0
"""What cannot be true is a fault with its name; noise, phantoms and missed detections are not."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.errors import ConfigurationError, InputError
from risk_dqn_planner.faults import FaultyInput, Status
from risk_dqn_planner.situation.inputs import EgoPose, ObjectArrays, Perception, object_arrays
from risk_dqn_planner.situation.limits import PlausibilityLimits
from risk_dqn_planner.situation.plausibility import Plausibility
from risk_dqn_planner.situation.situations import Floats
from risk_dqn_planner.situation.warm_up import square

AT_REST = EgoPose(0.0, 0.0, 0.0, 0.0)
SQUARE = square(20.0)
Found = tuple[Status, FaultyInput] | None


def see(
    node: Plausibility,
    time_s: float = 0.0,
    ego: EgoPose = AT_REST,
    objects: ObjectArrays | None = None,
    area: Floats = SQUARE,
) -> Found:
    try:
        node.check(Perception(ego, objects or object_arrays(), area), time_s, time_s)
    except InputError as error:
        return error.kind, error.source
    return None


def drive(*poses: tuple[float, EgoPose]) -> list[Found]:
    node = Plausibility()
    return [see(node, time_s, ego) for time_s, ego in poses]


def test_an_ego_that_drives_as_fast_as_it_says_is_plausible() -> None:
    poses = [(0.1 * k, EgoPose(0.5 * k, 0.0, 0.0, 5.0)) for k in range(20)]
    assert drive(*poses) == [None] * 20


def test_an_ego_faster_than_its_limit_is_not() -> None:
    fault = (Status.IMPLAUSIBLE_SPEED, FaultyInput.ODOMETRY)
    assert drive((0.0, EgoPose(0.0, 0.0, 0.0, -40.5)), (0.1, AT_REST))[0] == fault


def test_an_ego_that_jumps_is_a_fault_once_and_then_drives_on_from_there() -> None:
    # 1 m, and 5 m/s with an error of 3 m/s for 0.1 s, make 1.8 m.
    at = [EgoPose(x, 0.0, 0.0, 5.0) for x in (0.0, 1.75, 3.6, 4.1)]
    found = drive(*((0.1 * k, pose) for k, pose in enumerate(at)))
    assert found == [None, None, (Status.IMPLAUSIBLE_JUMP, FaultyInput.ODOMETRY), None]


def test_an_ego_that_turns_on_the_spot_jumps_too() -> None:
    # 0.5 rad and 1.5 rad/s for 0.2 s make 0.8 rad.
    turned = [EgoPose(0.0, 0.0, heading, 0.0) for heading in (3.1, -2.4, -1.5)]
    found = drive(*((0.2 * k, pose) for k, pose in enumerate(turned)))
    assert found == [None, None, (Status.IMPLAUSIBLE_JUMP, FaultyInput.ODOMETRY)]


def test_after_forgetting_the_ego_may_be_anywhere() -> None:
    node = Plausibility()
    see(node, 0.0, AT_REST)
    node.forget()
    assert see(node, 0.1, EgoPose(500.0, 0.0, 3.0, 0.0)) is None


def test_an_ego_that_says_to_drive_but_stays_is_frozen_until_it_moves() -> None:
    frozen = (Status.FROZEN_INPUT, FaultyInput.ODOMETRY)
    stays = [(0.25 * k, EgoPose(0.0, 0.0, 0.0, 5.0)) for k in range(6)]
    assert drive(*stays, (1.5, EgoPose(1.0, 0.0, 0.0, 5.0))) == [None] * 4 + [frozen] * 2 + [None]


def test_an_ego_that_waits_or_creeps_is_not_frozen() -> None:
    waits = [(0.5 * k, EgoPose(0.0, 0.0, 0.0, 0.4)) for k in range(6)]
    creeps = [(3.0 + 0.5 * k, EgoPose(0.3 * k, 0.0, 0.0, 0.6)) for k in range(6)]
    assert drive(*waits, *creeps) == [None] * 12


def cars(ids: Sequence[int], xs: Sequence[float], speed_mps: float = 5.0) -> ObjectArrays:
    return object_arrays([[x, 0.0, 0.0, speed_mps] for x in xs], list(ids), (4.0, 2.0))


def test_an_object_that_jumps_is_a_fault_and_named() -> None:
    node = Plausibility()
    assert see(node, 0.0, objects=cars([3, 9], [0.0, 50.0])) is None
    # 3 m, and 5 m/s with an error of 6 m/s for 0.1 s, make 4.1 m.
    assert see(node, 0.1, objects=cars([9, 3], [54.0, 0.5])) is None
    broken = Perception(AT_REST, cars([9, 3], [54.5, 4.7]), SQUARE)
    with pytest.raises(InputError, match=r"object 3: 4.2 m away after 0.10 s, .* at most 4.1 m"):
        node.check(broken, 0.2, 0.2)


def test_an_object_that_was_missed_for_a_while_may_come_back_further_on() -> None:
    node = Plausibility()
    see(node, 0.0, objects=cars([3], [0.0]))
    assert see(node, 0.5, objects=cars([], [])) is None
    assert see(node, 1.5, objects=cars([3], [7.5])) is None
    assert see(node, 1.6, objects=cars([3], [20.0])) == (
        Status.IMPLAUSIBLE_JUMP,
        FaultyInput.OBJECTS,
    )


def test_an_id_that_was_not_seen_for_two_seconds_may_be_another_vehicle_s() -> None:
    node = Plausibility()
    see(node, 0.0, objects=cars([3], [0.0]))
    see(node, 1.0, objects=cars([], []))
    assert see(node, 2.5, objects=cars([3], [500.0])) is None


@pytest.mark.parametrize(
    ("objects", "kind"),
    [
        (cars([1], [0.0], speed_mps=-61.0), Status.IMPLAUSIBLE_SPEED),
        (cars([1, 1], [0.0, 9.0]), Status.DUPLICATE_ID),
        (object_arrays([[0.0, 0.0, 0.0, 1.0]], size_m=(60.0, 2.0)), Status.INVALID_SIZE),
        (object_arrays([[0.0, 0.0, 0.0, 1.0]], size_m=(4.0, 7.0)), Status.INVALID_SIZE),
        (object_arrays([[0.0, 0.0, 0.0, 1.0]], size_m=(-4.0, 2.0)), Status.INVALID_SIZE),
        (object_arrays([[0.0, 0.0, math.nan, 1.0]]), Status.NOT_FINITE),
        (object_arrays([[0.0, 0.0, 1e300, 1.0]]), Status.MALFORMED_INPUT),
        (object_arrays(np.zeros((1001, 4))), Status.INVALID_SIZE),
    ],
)
def test_objects_that_cannot_be_are_faults(objects: ObjectArrays, kind: Status) -> None:
    assert see(Plausibility(), objects=objects) == (kind, FaultyInput.OBJECTS)


def test_five_hundred_objects_and_objects_of_unknown_size_are_plausible() -> None:
    assert see(Plausibility(), objects=object_arrays(np.zeros((500, 4)))) is None


BOW_TIE = np.array([[-5.0, -5.0], [5.0, 5.0], [5.0, -5.0], [-5.0, 5.0]])
LINE = np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]])


@pytest.mark.parametrize(
    ("area", "kind"),
    [
        (np.zeros((0, 2)), Status.INVALID_VISIBLE_AREA),
        (LINE, Status.INVALID_VISIBLE_AREA),
        (BOW_TIE, Status.INVALID_VISIBLE_AREA),
        (np.array([[0.0, 0.0], [math.inf, 0.0], [0.0, 5.0]]), Status.NOT_FINITE),
        (np.full((3, 2), 1e300), Status.INVALID_VISIBLE_AREA),
        (np.tile(SQUARE, (501, 1)), Status.INVALID_VISIBLE_AREA),
    ],
)
def test_a_visible_area_must_enclose_something_and_not_cross_itself(
    area: Floats, kind: Status
) -> None:
    assert see(Plausibility(), area=area) == (kind, FaultyInput.VISIBLE_AREA)


def test_an_outline_that_only_touches_itself_is_simple() -> None:
    # A notch whose sides lie on each other, and corners rounded by 1 cm.
    notch = np.array([[0, 0], [9, 0], [9, 9], [5, 9], [5.01, 2], [4.99, 2], [5, 9], [0, 9.0]])
    assert see(Plausibility(), area=notch) is None


SPIKE = np.array([[-20.0, -20.0], [20.0, -20.0], [3e38, 0.0], [20.0, 20.0], [-20.0, 20.0]])


def test_what_no_sensor_of_the_ego_can_see_is_a_fault_of_who_says_so() -> None:
    spike = (Status.INVALID_VISIBLE_AREA, FaultyInput.VISIBLE_AREA)
    far = (Status.MALFORMED_INPUT, FaultyInput.OBJECTS)
    assert see(Plausibility(), area=SPIKE) == spike
    for x_m, found in ((999.0, None), (1001.0, far), (-1e300, far)):
        assert see(Plausibility(), objects=object_arrays([[x_m, 0.0, 0.0, 0.0]])) == found


def test_it_is_not_blamed_for_an_ego_that_is_elsewhere() -> None:
    ego = EgoPose(1e300, 0.0, 0.0, 0.0)
    assert see(Plausibility(), ego=ego, objects=object_arrays([[0.0] * 4])) is None


def test_limits_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="max_ego_speed_mps is 0"):
        PlausibilityLimits(max_ego_speed_mps=0.0)


@given(
    st.lists(st.floats(-4.0, 4.0), min_size=5, max_size=20),
    st.floats(0.0, 8.0),
    st.sampled_from([0.1, 0.2, 0.5]),
)
def test_noisy_speeds_of_four_sigma_are_no_fault(
    noise: list[float], speed_mps: float, step_s: float
) -> None:
    # Positions as true as a tracker's, speeds with the noise N(0, 1) of the scenarios.
    node = Plausibility()
    for k, error in enumerate(noise):
        seen = cars([1], [speed_mps * step_s * k], speed_mps + error)
        assert see(node, step_s * k, objects=seen) is None
