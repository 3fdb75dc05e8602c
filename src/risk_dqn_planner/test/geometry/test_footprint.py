# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from risk_dqn_planner.geometry.footprint import footprint_corners, footprints_overlap

Pose = tuple[float, float, float]


def overlap(pose1: Pose, pose2: Pose, length: float = 4.0, width: float = 2.0) -> bool:
    return footprints_overlap(*pose1, length, width, *pose2, length, width)


@pytest.mark.parametrize(("gap", "expected"), [(2.99, True), (3.01, False)])
def test_perpendicular_cars_touch_at_half_length_and_half_width(gap: float, expected: bool) -> None:
    assert overlap((0.0, 0.0, 0.0), (gap, 0.0, math.pi / 2)) is expected
    assert overlap((0.0, 0.0, 0.0), (0.0, gap, math.pi / 2)) is expected


@pytest.mark.parametrize(("gap", "expected"), [(3.99, True), (4.01, False)])
def test_cars_in_line_touch_at_one_length(gap: float, expected: bool) -> None:
    assert overlap((0.0, 0.0, 0.0), (gap, 0.0, math.pi)) is expected


@pytest.mark.parametrize(("gap", "expected"), [(1.99, True), (2.01, False)])
def test_cars_side_by_side_touch_at_one_width(gap: float, expected: bool) -> None:
    assert overlap((0.0, 0.0, 0.0), (0.5, gap, 0.0)) is expected


def test_near_corners_do_not_count_as_overlap() -> None:
    # Centres nearer than the circumscribed circles, yet a diagonal car passes the corner.
    assert not overlap((0.0, 0.0, 0.0), (3.2, 2.4, -math.pi / 4))


def test_corners_start_front_left_and_go_counter_clockwise() -> None:
    corners = footprint_corners(1.0, 2.0, math.pi / 2, 4.0, 2.0)
    np.testing.assert_allclose(corners, [(0, 4), (0, 0), (2, 0), (2, 4)], atol=1e-12)


pose = st.tuples(st.floats(-6, 6), st.floats(-6, 6), st.floats(-7, 7))


@settings(deadline=None, max_examples=200)
@given(pose1=pose, pose2=pose)
def test_overlap_agrees_with_polygon_intersection(pose1: Pose, pose2: Pose) -> None:
    first = Polygon(footprint_corners(*pose1, 4.0, 2.0))
    second = Polygon(footprint_corners(*pose2, 4.0, 2.0))
    shared = first.intersection(second).area
    if shared > 1e-9:
        assert overlap(pose1, pose2)
    elif first.distance(second) > 1e-9:
        assert not overlap(pose1, pose2)


@settings(deadline=None)
@given(pose1=pose, pose2=pose)
def test_overlap_is_symmetric(pose1: Pose, pose2: Pose) -> None:
    assert overlap(pose1, pose2) == overlap(pose2, pose1)
