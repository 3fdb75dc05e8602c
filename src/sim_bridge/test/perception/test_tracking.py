# SPDX-License-Identifier: Apache-2.0
"""All pieces of a way that the simulator's sensor does not see."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from risk_dqn_planner.geometry.footprint import footprint_corners
from risk_dqn_planner.situation.hidden_space import hidden_work
from risk_dqn_planner.situation.situations import Floats
from sim_bridge.perception.tracking import add_out_of_range, add_shadow
from sim_bridge.perception.visibility import HALF_PLANES, cast_shadow, point_hidden

Points = list[tuple[float, float]]

# A wall from (-1, 4) to (1, 6), seen from the origin.
SQUARE = np.array([(-1.0, 4.0), (1.0, 4.0), (1.0, 6.0), (-1.0, 6.0)])


def pieces(
    points: Points, *obstacles: Floats, range_m: float = 1000.0, slack_m: float = 0.0
) -> list[tuple[float, float]]:
    """The hidden pieces of a way whose distances are arc lengths from its first point."""
    xy = np.array([points], dtype=np.float64)
    steps = np.hypot(*np.diff(xy[0], axis=0).T)
    distance = np.concatenate(([0.0], np.cumsum(steps)))[None]
    slack = np.full((1, len(points) - 1), slack_m)
    shadows = np.zeros((1, max(len(obstacles), 1), HALF_PLANES, 3))
    work, count = hidden_work(1, 0), np.array([len(points)])
    sets = work.hidden_near_m, work.hidden_far_m, work.hidden
    add_out_of_range(xy, distance, slack, count, 0.0, 0.0, range_m, *sets)
    for o, corners in enumerate(obstacles):
        cast_shadow(np.array([[corners]]), 0, 0, 0.0, 0.0, shadows, 0, o)
        add_shadow(xy, distance, slack, count, shadows, 0, o, *sets)
    return [
        (float(work.hidden_near_m[0, k]), float(work.hidden_far_m[0, k]))
        for k in range(work.hidden[0])
    ]


def test_a_way_that_is_seen_as_a_whole_has_no_hidden_piece() -> None:
    assert pieces([(-10.0, 2.0), (10.0, 2.0)], SQUARE, range_m=20.0) == []


def test_a_shadow_hides_a_way_from_tangent_to_tangent() -> None:
    # The tangents through (-1, 4) and (1, 4) meet y = 10 at x = -2.5 and 2.5.
    assert pieces([(-10.0, 10.0), (10.0, 10.0)], SQUARE) == [pytest.approx((7.5, 12.5))]


def test_a_piece_goes_on_over_the_corners_of_a_way() -> None:
    way = [(-10.0, 10.0), (0.0, 10.0), (1.0, 10.0), (10.0, 10.0)]
    assert pieces(way, SQUARE) == [pytest.approx((7.5, 12.5))]


def test_both_ends_of_a_way_may_be_out_of_range() -> None:
    # The circle of 10 m meets y = 6 at x = -8 and 8.
    way = [(-30.0, 6.0), (30.0, 6.0)]
    assert pieces(way, range_m=10.0) == [pytest.approx((0, 22)), pytest.approx((38, 60))]


def test_a_way_that_is_too_far_away_is_hidden_as_a_whole() -> None:
    assert pieces([(-30.0, 11.0), (0.0, 11.0), (30.0, 11.0)], range_m=10.0) == [
        pytest.approx((0.0, 60.0))
    ]


def test_two_obstacles_and_the_range_leave_the_gaps_between_them() -> None:
    left, right = SQUARE + np.array([-4.0, 0.0]), SQUARE + np.array([4.0, 0.0])
    # Tangents through (-5, 4), (-3, 6), (3, 6), (5, 4); the circle of 26 m meets y = 10 at 24 m.
    assert pieces([(-40.0, 10.0), (40.0, 10.0)], left, right, range_m=26.0) == [
        pytest.approx((0, 16)),
        pytest.approx((27.5, 35)),
        pytest.approx((45, 52.5)),
        pytest.approx((64, 80)),
    ]


def test_slack_widens_shadows_and_narrows_the_range_by_as_much_beside_the_way() -> None:
    near, far = pieces([(-40.0, 10.0), (40.0, 10.0)], SQUARE, slack_m=0.1)[0]
    # Tangents of slope 4: moved by 0.1 m to their side they meet the way 0.1 sqrt(17) / 4 earlier.
    widened = 0.1 * math.sqrt(17.0) / 4.0
    assert (near, far) == pytest.approx((37.5 - widened, 42.5 + widened))
    assert pieces([(0.0, 0.0), (20.0, 0.0)], range_m=10.0, slack_m=0.5) == [
        pytest.approx((9.5, 20))
    ]


def test_a_sensor_in_an_obstacle_sees_nothing() -> None:
    around = SQUARE - np.array([0.0, 5.0])
    assert pieces([(-10.0, 10.0), (10.0, 10.0)], around) == [(0.0, 20.0)]


rectangles = st.builds(
    footprint_corners,
    st.floats(-30.0, 30.0),
    st.floats(-30.0, 30.0),
    st.floats(-math.pi, math.pi),
    st.floats(1.0, 15.0),
    st.floats(1.0, 15.0),
)
ways = st.lists(st.tuples(st.floats(-40.0, 40.0), st.floats(-40.0, 40.0)), min_size=2, max_size=5)


@given(ways, st.lists(rectangles, max_size=3))
def test_the_pieces_hold_exactly_the_points_that_are_hidden(
    way: Points, obstacles: list[Floats]
) -> None:
    sensor = shapely.Point(0.0, 0.0)
    assume(all(shapely.Polygon(corners).distance(sensor) > 0.5 for corners in obstacles))
    xy = np.array(way)
    steps = np.hypot(*np.diff(xy, axis=0).T)
    assume((steps > 0.1).all())
    distance = np.concatenate(([0.0], np.cumsum(steps)))
    found = pieces(way, *obstacles, range_m=30.0, slack_m=1e-6)
    shadows = np.zeros((1, max(len(obstacles), 1), HALF_PLANES, 3))
    for o, corners in enumerate(obstacles):
        cast_shadow(np.array([[corners]]), 0, 0, 0.0, 0.0, shadows, 0, o)
    for at in np.linspace(0.0, distance[-1], 200):
        x, y = (float(np.interp(at, distance, xy[:, axis])) for axis in range(2))
        hidden = point_hidden(x, y, 0.0, 0.0, 30.0, shadows, 0, len(obstacles))
        assert not hidden or any(near <= at <= far for near, far in found)
        # Strictly within a piece, but for what slack makes of a grazing line of sight, a point is
        # hidden; nine intervals of a way have room.
        inside = any(near + 1e-3 < at < far - 1e-3 for near, far in found)
        assert hidden or not inside or _near_the_edge(x, y, shadows, len(obstacles))


def _near_the_edge(x: float, y: float, shadows: Floats, count: int) -> bool:
    """Whether a point is at most 10 micrometres from where it would be hidden."""
    small = 1e-5
    around = [(x + i * small, y + j * small) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    return any(point_hidden(*at, 0.0, 0.0, 30.0, shadows, 0, count) for at in around)
