# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.errors import MapError
from risk_dqn_planner.geometry.polyline import Polyline

CORNER = Polyline.from_points([(0.0, 0.0), (10.0, 0.0), (10.0, 5.0)])


def test_arc_length_and_headings_of_a_right_angle() -> None:
    np.testing.assert_allclose(CORNER.s, [0.0, 10.0, 15.0])
    np.testing.assert_allclose(CORNER.heading, [0.0, math.pi / 2])
    assert CORNER.length_m == 15.0


@pytest.mark.parametrize(
    ("s", "expected"),
    [
        (0.0, (0.0, 0.0)),
        (4.0, (4.0, 0.0)),
        (10.0, (10.0, 0.0)),
        (12.5, (10.0, 2.5)),
        (-3.0, (-3.0, 0.0)),
        (18.0, (10.0, 8.0)),
    ],
)
def test_position_interpolates_and_goes_straight_on_beyond_the_ends(
    s: float, expected: tuple[float, float]
) -> None:
    assert CORNER.position(s) == pytest.approx(expected)


def test_heading_is_that_of_the_segment_ahead_at_a_corner() -> None:
    assert CORNER.heading_at(9.999) == 0.0
    assert CORNER.heading_at(10.0) == pytest.approx(math.pi / 2)
    assert CORNER.heading_at(99.0) == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((4.0, 1.0), (4.0, 1.0, 0.0)),
        ((4.0, -2.0), (4.0, -2.0, 0.0)),
        ((-3.0, 0.5), (-3.0, 0.5, 0.0)),
        ((9.0, 7.0), (17.0, 1.0, math.pi / 2)),
        ((11.0, 3.0), (13.0, -1.0, math.pi / 2)),
    ],
)
def test_projection_gives_arc_length_and_offset_left_positive(
    point: tuple[float, float], expected: tuple[float, float, float]
) -> None:
    assert CORNER.project(*point) == pytest.approx(expected)


def test_outside_of_a_corner_projects_onto_the_corner() -> None:
    projection = CORNER.project(13.0, -4.0)
    assert projection.s == pytest.approx(10.0)
    assert projection.lateral_m == pytest.approx(-5.0)


def test_heading_tells_the_two_passes_of_a_loop_apart() -> None:
    # East through the origin, round three corners, then north through the origin.
    loop = Polyline.from_points([(-10, 0), (10, 0), (10, -10), (0, -10), (0, 10)])
    east = loop.project(0.1, 0.1, 0.0, math.radians(60))
    north = loop.project(0.1, 0.1, math.pi / 2, math.radians(60))
    assert east == pytest.approx((10.1, 0.1, 0.0))
    assert north == pytest.approx((50.1, -0.1, math.pi / 2))


def test_a_heading_that_no_segment_has_falls_back_to_the_nearest() -> None:
    projection = CORNER.project(4.0, 1.0, -2.5, math.radians(20))
    assert projection == pytest.approx((4.0, 1.0, 0.0))


def test_heading_preference_wins_over_an_earlier_nearer_segment() -> None:
    projection = CORNER.project(9.0, 0.5, math.pi / 2, math.radians(45))
    assert projection == pytest.approx((10.5, 1.0, math.pi / 2))


def test_repeated_points_are_dropped() -> None:
    line = Polyline.from_points([(0, 0), (0, 0), (3, 4), (3, 4), (3, 5)])
    np.testing.assert_allclose(line.xy, [(0, 0), (3, 4), (3, 5)])
    np.testing.assert_allclose(line.s, [0, 5, 6])


@pytest.mark.parametrize("points", [[], [(1, 1)], [(1, 1), (1, 1)]])
def test_fewer_than_two_distinct_points_are_refused(points: list[tuple[float, float]]) -> None:
    with pytest.raises(MapError, match="two distinct points"):
        Polyline.from_points(points)


def test_points_that_are_not_finite_are_refused() -> None:
    with pytest.raises(MapError, match="not finite"):
        Polyline.from_points([(0, 0), (math.nan, 1)])


turns = st.lists(st.floats(-0.4, 0.4), min_size=2, max_size=12)


@settings(deadline=None)
@given(turns=turns, share=st.floats(0.0, 1.0), offset=st.floats(-1.5, 1.5))
def test_projecting_a_pose_on_a_gentle_curve_returns_its_arc_length(
    turns: list[float], share: float, offset: float
) -> None:
    headings = np.cumsum(turns)
    steps = 5.0 * np.column_stack((np.cos(headings), np.sin(headings)))
    line = Polyline.from_points(np.vstack(([0.0, 0.0], np.cumsum(steps, axis=0))))
    at = share * line.length_m
    x, y = line.position(at)
    heading = line.heading_at(at)
    back = line.project(
        x - offset * math.sin(heading), y + offset * math.cos(heading), heading, 0.7
    )
    # Inside a bend the nearest point may lie on the neighbouring segment.
    slack = abs(offset) * math.tan(0.4) + 1e-6
    assert back.s == pytest.approx(at, abs=slack)
    assert abs(back.lateral_m) <= abs(offset) + 1e-9
