# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from risk_dqn_planner.geometry.polyline import Polyline, arc_lengths
from risk_dqn_planner.geometry.smoothing import CHORD_TOLERANCE_M, join, smooth


def largest_turn(points: NDArray[np.float64]) -> float:
    headings = np.unwrap(Polyline.from_points(points[:, :2]).heading)
    return float(np.degrees(np.abs(np.diff(headings)).max(initial=0.0)))


def test_a_straight_line_becomes_its_two_ends_however_it_was_sampled() -> None:
    given_points = np.array([[0.0, 0.0, 1.0], [0.3, 0.4, 1.0], [3.0, 4.0, 1.0], [30.0, 40.0, 1.0]])
    points, at = smooth(given_points)
    np.testing.assert_allclose(points, [[0, 0, 1], [30, 40, 1]], atol=1e-12)
    np.testing.assert_allclose(at, [0.0, 50.0])


def test_a_corner_becomes_a_bend_without_jumps_of_the_heading() -> None:
    corner = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]])
    points, _ = smooth(corner)
    assert largest_turn(corner) == pytest.approx(90.0)
    # 3 m on either side, in steps of half a metre: 90 degrees over about 12 steps, more in
    # the middle.
    assert largest_turn(points) < 20.0
    np.testing.assert_allclose(points[[0, -1]], corner[[0, -1]])
    nearest = min(math.dist(point, (20.0, 0.0)) for point in points)
    assert 0.3 < nearest < 1.0


def test_a_circle_keeps_its_radius_within_centimetres() -> None:
    angles = np.radians(np.arange(0.0, 181.0, 4.0))
    points, _ = smooth(10.0 * np.column_stack((np.cos(angles), np.sin(angles))))
    inner = points[(points[:, 1] > 3.0)]
    radii = np.hypot(inner[:, 0], inner[:, 1])
    # Averaging twice over 3.5 m flattens an arc by 2 * 3.5^2 / 24 / R = 0.1 m.
    assert radii.min() > 9.85
    assert radii.max() < 10.01


def test_heights_are_carried_along() -> None:
    points, at = smooth(np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 5.0]]))
    np.testing.assert_allclose(points[:, 2], 0.05 * at, atol=1e-9)


@settings(deadline=None, max_examples=40)
@given(
    turns=st.lists(st.floats(-0.6, 0.6), min_size=3, max_size=10),
    angle=st.floats(-3.0, 3.0),
)
def test_a_turned_line_is_smoothed_to_the_turned_result(turns: list[float], angle: float) -> None:
    headings = np.cumsum(turns)
    steps = 4.0 * np.column_stack((np.cos(headings), np.sin(headings)))
    line = np.vstack(([0.0, 0.0], np.cumsum(steps, axis=0)))
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    still = Polyline.from_points(smooth(line)[0])
    turned = Polyline.from_points(smooth(line @ turn)[0])
    assert turned.length_m == pytest.approx(still.length_m, abs=2.0 * CHORD_TOLERANCE_M)
    for s in np.linspace(0.0, still.length_m, 7):
        assert turned.position(s) == pytest.approx(
            np.array(still.position(s)) @ turn, abs=2.0 * CHORD_TOLERANCE_M
        )


def test_parts_that_meet_are_joined_at_their_common_point() -> None:
    first, second = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[10.0, 0.0], [20.0, 1.0]])
    points, starts = join([first, second])
    np.testing.assert_allclose(points, [[0, 0], [10, 0], [20, 1]])
    assert starts == [0, 1]


def test_a_sideways_step_is_bridged_half_way_and_gently() -> None:
    first = np.array([[0.0, 0.0], [5.0, 0.0], [9.5, 0.0], [10.0, 0.0]])
    second = np.array([[10.0, 0.6], [10.4, 0.6], [15.0, 0.6], [20.0, 0.6]])
    points, starts = join([first, second])
    # Points within 3 * 0.6 m of the meeting point (10, 0.3) give way.
    np.testing.assert_allclose(
        points, [[0.0, 0.0], [5.0, 0.0], [10.0, 0.3], [15.0, 0.6], [20.0, 0.6]]
    )
    assert starts == [0, 2]
    assert largest_turn(points) < 4.0


def test_a_part_that_begins_behind_the_end_does_not_turn_the_line_back() -> None:
    first, second = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[9.6, 0.0], [20.0, 0.0]])
    points, _ = join([first, second])
    assert (np.diff(points[:, 0]) > 0.0).all()


def test_a_gap_ahead_is_crossed_straight() -> None:
    first, second = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[12.0, 0.1], [20.0, 0.1]])
    points, starts = join([first, second])
    # The second part begins where the first one ended, so that nothing is left out.
    np.testing.assert_allclose(points, [[0.0, 0.0], [10.0, 0.0], [20.0, 0.1]])
    assert starts == [0, 1]
    assert arc_lengths(points)[-1] == pytest.approx(20.0, abs=0.01)
