# SPDX-License-Identifier: Apache-2.0
"""How far lane 1 (north through the origin, zone from y = -3 to 3) is seen without a gap."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import ConflictPath, IntersectionModel, LanePath
from risk_dqn_planner.situation.occlusion import hidden_distances_kernel, inside_kernel
from risk_dqn_planner.situation.paths import path_table
from risk_dqn_planner.situation.situations import Floats
from risk_dqn_planner.situation.warm_up import crossing_model, square

RANGE = 70.0


def hidden(
    polygon: Sequence[Sequence[float]] | Floats,
    model: IntersectionModel | None = None,
    sensor_range: float = RANGE,
) -> float:
    chosen = crossing_model() if model is None else model
    area = np.asarray(polygon, dtype=np.float64)
    return float(hidden_distances_kernel(path_table(chosen), 1, area, sensor_range)[0])


def test_the_hidden_distance_is_where_the_polygon_is_left() -> None:
    assert hidden([[-50, -25], [50, -25], [50, 25], [-50, 25]]) == pytest.approx(25.0)


def test_a_slanted_edge_is_met_exactly() -> None:
    # The lower edge falls from y = -10 at x = -10 to y = -30 at x = 10: -20 at the lane.
    assert hidden([[-10, -10], [10, -30], [10, 20], [-10, 20]]) == pytest.approx(20.0)


def test_a_lane_seen_as_a_whole_reaches_to_the_sensor_range() -> None:
    assert hidden(square(100.0), sensor_range=40.0) == pytest.approx(40.0)


def test_a_lane_seen_to_where_the_map_ends_hides_nothing_within_range() -> None:
    assert hidden(square(100.0), sensor_range=90.0) == pytest.approx(90.0)


def test_a_hidden_zone_leaves_nothing_free() -> None:
    assert hidden([[-50, -50], [50, -50], [50, 2.9], [-50, 2.9]]) == pytest.approx(-3.0)


def test_a_zone_whose_middle_is_hidden_is_free_only_behind_it() -> None:
    # A shadow over y = -1 to 1, cut in from the right.
    notched = [[-50, -50], [50, -50], [50, -1], [-20, -1], [-20, 1], [50, 1], [50, 50], [-50, 50]]
    assert hidden(notched) == pytest.approx(-1.0)


def test_a_shadow_upstream_hides_even_where_the_lane_is_seen_again_behind_it() -> None:
    # The shadow of an obstacle covers y = -22 to -15; the lane is seen again from -22 to -50.
    shadow = [
        [-50, -50],
        [50, -50],
        [50, -22],
        [-5, -22],
        [-5, -15],
        [50, -15],
        [50, 20],
        [-50, 20],
    ]
    assert hidden(shadow) == pytest.approx(15.0)


def test_a_corner_that_only_touches_the_lane_hides_nothing() -> None:
    touching = [[-50, -50], [50, -50], [50, -20], [0, -15], [50, -10], [50, 20], [-50, 20]]
    assert hidden(touching) == pytest.approx(50.0)


def test_a_corner_that_reaches_across_the_lane_hides() -> None:
    across: list[list[float]] = [
        [-50, -50],
        [50, -50],
        [50, -20],
        [-0.1, -15],
        [50, -10],
        [50, 20],
        [-50, 20],
    ]
    assert hidden(across) == pytest.approx(15.0, abs=0.02)


def test_an_edge_that_meets_the_lane_at_one_of_its_own_points_is_met() -> None:
    model = with_line([[0.0, -70.0], [0.0, -25.0], [0.0, 30.0]])
    assert hidden([[-50, -25], [50, -25], [50, 25], [-50, 25]], model) == pytest.approx(25.0)


def test_an_edge_through_the_start_of_the_search_is_met() -> None:
    # The polygon's upper edge lies exactly on the zone's exit: the zone itself is seen.
    assert hidden([[-50, -25], [50, -25], [50, 3], [-50, 3]]) == pytest.approx(25.0)


def test_an_edge_along_the_lane_is_no_end() -> None:
    # From y = -10 to -20 the polygon's right edge runs exactly along the lane, then widens.
    stepped = [[-50, -40], [50, -40], [50, -20], [0, -20], [0, -10], [50, -10], [50, 20], [-50, 20]]
    shifted = np.array(stepped, dtype=np.float64)
    shifted[3:5, 0] += 0.01
    assert hidden(shifted) == pytest.approx(40.0)
    shifted[3:5, 0] -= 0.02
    assert hidden(shifted) == pytest.approx(10.0)


def test_the_nearest_hidden_place_of_all_branches_counts() -> None:
    model = crossing_model()
    lane = model.lanes[0]
    line = Polyline.from_points([[-40.0, -10.0], [0.0, -10.0], [0.0, 30.0]])
    branch = ConflictPath(LanePath((1,), (0.0,), line, 1.75), 50.0, math.inf)
    for paths in ((lane.paths[0], branch), (branch, lane.paths[0])):
        both = replace(model, lanes=(replace(lane, paths=paths),))
        area = [[-12, -60], [50, -60], [50, 60], [-12, 60]]
        # 10 m to the corner and 12 m west, against 60 m south.
        assert hidden(area, both) == pytest.approx(22.0)


def with_line(points: list[list[float]]) -> IntersectionModel:
    model = crossing_model()
    lane = model.lanes[0]
    line = Polyline.from_points(points)
    path = replace(lane.paths[0], path=replace(lane.paths[0].path, centerline=line))
    return replace(model, lanes=(replace(lane, paths=(path,)),))


def star(radii: list[float]) -> np.ndarray:
    angles = np.linspace(0.0, 2.0 * math.pi, len(radii), endpoint=False)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


RADII = st.lists(st.floats(5.0, 60.0), min_size=3, max_size=40)


@settings(max_examples=100, deadline=None)
@given(RADII)
def test_orientation_and_closing_point_of_the_polygon_do_not_matter(radii: list[float]) -> None:
    polygon = star(radii)
    expected = hidden(polygon)
    assert hidden(polygon[::-1]) == pytest.approx(expected)
    assert hidden(np.concatenate([polygon, polygon[:1]])) == pytest.approx(expected)
    assert hidden(np.roll(polygon, 1, axis=0)) == pytest.approx(expected)


@settings(max_examples=100, deadline=None)
@given(RADII)
def test_nothing_before_the_hidden_place_is_hidden_and_right_behind_it_something_is(
    radii: list[float],
) -> None:
    polygon = star(radii)
    distance = hidden(polygon)
    for y in np.linspace(-distance + 1e-3, 3.0 - 1e-3, 50):
        assert -distance > 3.0 - 2e-3 or inside_kernel(polygon, 0.0, y)
    if distance < 69.0 and distance > -3.0:
        assert not inside_kernel(polygon, 0.0, -distance - 1e-6)
