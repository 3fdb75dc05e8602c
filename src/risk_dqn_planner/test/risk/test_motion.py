# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.risk.motion import distance_after, speed_after, time_to_cover

speeds = st.floats(0.0, 15.0)
times = st.floats(0.0, 20.0)


def test_from_rest_without_reaching_top_speed_is_the_papers_formula() -> None:
    # sqrt(2 * 6 / 1.5) = sqrt(8); 2.83 s * 1.5 m/s^2 = 4.24 m/s, below 5.
    assert time_to_cover(6.0, 0.0, 1.5, 5.0) == pytest.approx(math.sqrt(8.0))


def test_top_speed_reached_on_the_way_is_kept() -> None:
    # 5/1.5 = 3.3333 s and 8.3333 m to reach 5 m/s, then 11.6667 m at 5 m/s = 2.3333 s.
    assert time_to_cover(20.0, 0.0, 1.5, 5.0) == pytest.approx(5.6666667)


def test_a_start_speed_shortens_the_way() -> None:
    # 3 t + t^2 = 10 (acceleration 2): t = -1.5 + sqrt(2.25 + 10) = 2.
    assert time_to_cover(10.0, 3.0, 2.0, 15.0) == pytest.approx(2.0)


def test_a_start_above_top_speed_is_kept() -> None:
    assert time_to_cover(20.0, 10.0, 2.0, 7.0) == pytest.approx(2.0)


def test_a_reversing_vehicle_first_comes_back() -> None:
    # -2 t + t^2 = 3: t = 3.
    assert time_to_cover(3.0, -2.0, 2.0, 7.0) == pytest.approx(3.0)


def test_a_covered_distance_takes_no_time() -> None:
    assert time_to_cover(0.0, 0.0, 1.5, 5.0) == 0.0
    assert time_to_cover(-3.0, 2.0, 1.5, 5.0) == 0.0


@pytest.mark.parametrize("speed", [0.0, -1.0])
def test_who_cannot_accelerate_never_arrives(speed: float) -> None:
    assert time_to_cover(1.0, speed, 0.0, 5.0) == math.inf
    assert time_to_cover(1.0, speed, 2.0, -2.0) == math.inf


def test_without_acceleration_a_speed_is_kept() -> None:
    assert time_to_cover(10.0, 4.0, 0.0, 5.0) == pytest.approx(2.5)


def test_tiny_distances_at_speed_do_not_cancel() -> None:
    assert time_to_cover(1e-12, 4.0, 2.0, 15.0) == pytest.approx(0.25e-12, rel=1e-9)


def test_functions_broadcast_like_numpy() -> None:
    result = time_to_cover(np.array([[6.0], [-1.0]]), np.zeros(2), 1.5, 5.0)
    assert result.shape == (2, 2)
    np.testing.assert_allclose(result, [[math.sqrt(8.0)] * 2, [0.0, 0.0]])


def test_fast_from_rest_covers_three_metres_in_two_seconds() -> None:
    assert distance_after(2.0, 0.0, 5.0, 1.5, 3.5) == pytest.approx(3.0)
    assert speed_after(2.0, 0.0, 5.0, 1.5, 3.5) == pytest.approx(3.0)


def test_fast_is_kept_once_reached() -> None:
    # From 4 m/s: 2/3 s and 3 m to 5 m/s, then 4/3 s at 5 m/s = 6.6667 m.
    assert distance_after(2.0, 4.0, 5.0, 1.5, 3.5) == pytest.approx(9.6666667)
    assert speed_after(2.0, 4.0, 5.0, 1.5, 3.5) == 5.0


def test_slow_brakes_down_to_its_speed() -> None:
    # From 4.5 m/s: 1 s and 2.75 m to 1 m/s, then 1 s at 1 m/s.
    assert distance_after(2.0, 4.5, 1.0, 1.5, 3.5) == pytest.approx(3.75)
    assert speed_after(2.0, 4.5, 1.0, 1.5, 3.5) == 1.0


def test_stop_comes_to_rest_and_stays() -> None:
    # 3.5^2 / (2 * 3.5) = 1.75 m.
    assert distance_after(2.0, 3.5, 0.0, 1.5, 3.5) == pytest.approx(1.75)
    assert speed_after(2.0, 3.5, 0.0, 1.5, 3.5) == 0.0
    assert distance_after(0.5, 3.5, 0.0, 1.5, 3.5) == pytest.approx(1.3125)


def test_no_time_changes_nothing() -> None:
    assert distance_after(0.0, 4.0, 1.0, 1.5, 3.5) == 0.0
    assert speed_after(0.0, 4.0, 1.0, 1.5, 3.5) == 4.0


@given(st.floats(0.01, 100.0), speeds, st.floats(0.5, 15.0))
def test_the_time_to_cover_a_distance_covers_it(distance: float, speed: float, top: float) -> None:
    time = time_to_cover(distance, speed, 2.0, top)
    assert distance_after(time, speed, max(speed, top), 2.0, 0.0) == pytest.approx(distance)


@given(times, times, speeds, st.floats(0.0, 15.0))
def test_motion_in_two_parts_is_motion_in_one(
    first: float, second: float, speed: float, target: float
) -> None:
    middle = speed_after(first, speed, target, 1.5, 3.5)
    parts = distance_after(first, speed, target, 1.5, 3.5)
    parts += distance_after(second, middle, target, 1.5, 3.5)
    whole = distance_after(first + second, speed, target, 1.5, 3.5)
    assert parts == pytest.approx(whole, abs=1e-9)
    assert speed_after(second, middle, target, 1.5, 3.5) == pytest.approx(
        speed_after(first + second, speed, target, 1.5, 3.5), abs=1e-9
    )
