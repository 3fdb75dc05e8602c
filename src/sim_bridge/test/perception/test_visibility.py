# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from risk_dqn_planner.geometry.footprint import footprint_corners
from risk_dqn_planner.situation.situations import Floats
from sim_bridge.perception.visibility import (
    HALF_PLANES,
    cast_shadow,
    first_hidden,
    point_hidden,
    range_exit,
)
from sim_bridge.perception.visible_area import visible_polygon

FAR = 1000.0
# A wall from (-1, 4) to (1, 6).
SQUARE = np.array([(-1.0, 4.0), (1.0, 4.0), (1.0, 6.0), (-1.0, 6.0)])


def shadows_of(x: float, y: float, *obstacles: Floats):
    shadows = np.zeros((1, max(len(obstacles), 1), HALF_PLANES, 3))
    for o, corners in enumerate(obstacles):
        cast_shadow(np.array([[corners]]), 0, 0, x, y, shadows, 0, o)
    return shadows


def hidden(
    px: float, py: float, *obstacles: Floats, x: float = 0.0, y: float = 0.0, range_m: float = FAR
):
    shadows = shadows_of(x, y, *obstacles)
    return bool(point_hidden(px, py, x, y, range_m, shadows, 0, len(obstacles)))


def hidden_on(
    points: list[tuple[float, float]],
    *obstacles: Floats,
    x: float = 0.0,
    y: float = 0.0,
    range_m: float = FAR,
):
    """Walk along points whose distances are their arc lengths from the first."""
    xy = np.array([points], dtype=np.float64)
    steps = np.hypot(*np.diff(xy[0], axis=0).T)
    distance = np.concatenate(([0.0], np.cumsum(steps)))[None]
    shadows = shadows_of(x, y, *obstacles)
    return first_hidden(xy, distance, 0, len(points), x, y, range_m, shadows, 0, len(obstacles))


@pytest.mark.parametrize(
    ("point", "is_hidden"),
    [
        ((0.0, 3.9), False),  # before the wall
        ((0.0, 5.0), True),  # inside
        ((0.0, 100.0), True),  # behind
        ((2.4, 10.0), True),  # the tangent through (1, 4) has x = y / 4
        ((2.6, 10.0), False),
        ((-2.6, 10.0), False),
        ((0.0, -10.0), False),  # behind the sensor
        ((2.5, 10.0), False),  # the edge of the shadow is visible
    ],
)
def test_a_square_hides_what_lies_between_its_tangents_and_behind_it(
    point: tuple[float, float], is_hidden: bool
):
    assert hidden(*point, SQUARE) == is_hidden


def test_a_sensor_that_sees_two_sides_has_its_tangents_through_the_outer_corners():
    # From (-5, 0) the corners (-1, 6) and (1, 4) bound the square; slopes 6/4 and 4/6.
    for slope, inside in [(1.51, False), (1.49, True), (0.67, True), (0.66, False)]:
        assert hidden(-5.0 + 20.0, 20.0 * slope, SQUARE, x=-5.0) == inside
    assert not hidden(-2.0, 3.9, SQUARE, x=-5.0)  # between the tangents, but before both sides
    assert hidden(0.0, 5.0, SQUARE, x=-5.0)


def test_a_sensor_inside_an_obstacle_sees_nothing():
    assert hidden(0.0, 5.1, SQUARE, y=5.0)
    assert hidden(100.0, 5.0, SQUARE, y=5.0)


def test_what_is_out_of_range_is_hidden():
    assert not hidden(70.0, 0.0, range_m=70.0)
    assert hidden(70.01, 0.0, range_m=70.0)


def test_a_lane_is_seen_up_to_the_tangent_of_the_obstacle():
    # Along y = 10 from x = 0 to the right the wall of a rectangle from x = 2, y = 4..6 begins to
    # hide at the line through (2, 6): x = 10 / 3.
    wall = np.array([(2.0, 4.0), (9.0, 4.0), (9.0, 6.0), (2.0, 6.0)])
    assert hidden_on([(0.0, 10.0), (50.0, 10.0)], wall) == pytest.approx(10.0 / 3.0)


def test_a_lane_is_seen_up_to_the_range():
    # The circle of 26 m meets y = 10 at x = 24.
    assert hidden_on([(0.0, 10.0), (50.0, 10.0)], range_m=26.0) == pytest.approx(24.0)


def test_a_lane_that_is_seen_to_its_end_hides_nothing_within_range():
    assert (
        hidden_on([(0.0, 10.0), (30.0, 10.0), (30.0, 20.0)], SQUARE + np.array([100.0, 0.0]))
        == 1000.0
    )


def test_a_lane_that_begins_hidden_gives_its_beginning():
    assert hidden_on([(0.0, 10.0), (50.0, 10.0)], SQUARE) == 0.0


def test_the_first_of_two_obstacles_along_a_lane_counts():
    near, far = SQUARE + np.array([6.0, 0.0]), SQUARE + np.array([12.0, 0.0])
    # Tangent to `near` through (5, 6): x = 10 * 5 / 6.
    for obstacles in ((near, far), (far, near)):
        assert hidden_on([(0.0, 10.0), (50.0, 10.0)], *obstacles) == pytest.approx(50.0 / 6.0)


def test_a_lane_that_runs_along_the_edge_of_a_shadow_stays_visible():
    assert hidden_on([(1.0, 4.0), (10.0, 40.0)], SQUARE) == 1000.0


def test_the_exit_from_the_range_is_the_hand_computed_share():
    # From (3, 0) to (3, 8) leaves a circle of 5 m at (3, 4): half way.
    assert range_exit(3.0, 0.0, 0.0, 8.0, 5.0) == pytest.approx(0.5)


rectangles = st.builds(
    footprint_corners,
    st.floats(-30.0, 30.0),
    st.floats(-30.0, 30.0),
    st.floats(-math.pi, math.pi),
    st.floats(1.0, 15.0),
    st.floats(1.0, 15.0),
)


@given(st.lists(rectangles, max_size=3), st.integers(0, 2**32 - 1))
def test_the_visible_polygon_says_the_same_as_the_half_planes(obstacles: list[Floats], seed: int):
    sensor = shapely.Point(0.0, 0.0)
    assume(all(shapely.Polygon(corners).distance(sensor) > 0.5 for corners in obstacles))
    polygon = shapely.Polygon(visible_polygon(0.0, 0.0, 40.0, obstacles))
    assert polygon.is_valid
    assert polygon.contains(sensor)
    shadows = shadows_of(0.0, 0.0, *obstacles)
    for x, y in np.random.default_rng(seed).uniform(-42.0, 42.0, (60, 2)):
        point = shapely.Point(x, y)
        # Up to 3 mm lie between the circle and its polygon of 256 corners.
        if polygon.exterior.distance(point) < 5e-3:
            continue
        expected = bool(point_hidden(x, y, 0.0, 0.0, 40.0, shadows, 0, len(obstacles)))
        assert polygon.contains(point) != expected, (x, y)


@given(st.lists(rectangles, min_size=1, max_size=3), st.floats(-math.pi, math.pi))
def test_the_first_hidden_place_of_a_way_is_where_its_points_begin_to_be_hidden(
    obstacles: list[Floats], turn: float
):
    sensor = shapely.Point(0.0, 0.0)
    assume(all(shapely.Polygon(corners).distance(sensor) > 0.5 for corners in obstacles))
    ahead = np.array([math.cos(turn), math.sin(turn)])
    start = 3.0 * np.array([-ahead[1], ahead[0]])
    end = start + 60.0 * ahead
    found = hidden_on([start, end], *obstacles, range_m=50.0)
    for way in np.linspace(0.0, 60.0, 121):
        x, y = start + way * ahead
        if way < found - 1e-6:
            assert not hidden(x, y, *obstacles, range_m=50.0)
    if found < 60.0 - 1e-3:
        just_behind = start + (found + 1e-4) * ahead
        tiny = hidden(*just_behind, *obstacles, range_m=50.0)
        # A corner may be grazed over less than a tenth of a millimetre.
        assert tiny or hidden(*(start + (found + 1e-9) * ahead), *obstacles, range_m=50.0)


def test_the_visible_polygon_of_an_open_field_is_a_disc():
    polygon = shapely.Polygon(visible_polygon(3.0, 4.0, 70.0, []))
    assert polygon.area == pytest.approx(math.pi * 70.0**2, rel=2e-4)
    assert len(polygon.exterior.coords) == 257
