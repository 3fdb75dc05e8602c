# SPDX-License-Identifier: Apache-2.0
import math
from dataclasses import replace

import numpy as np
import pytest

from risk_dqn_planner.errors import NoConflictError, ScenarioError
from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.vehicle import VehicleDimensions
from sim_bridge.scenarios.fields import EgoStart, Interval, Sensor
from sim_bridge.scenarios.loading import Scenario
from sim_bridge.world.path_geometry import cut, sampled, shared_stretch, simplified, table_pose
from sim_bridge.world.sharing import JOIN_VIEW_M, Sharing, sharing
from sim_bridge.world.world import World, build_world


@pytest.fixture(scope="module")
def crossing_world(crossing_model: IntersectionModel, empty_road: Scenario) -> World:
    return build_world(crossing_model, empty_road)


@pytest.fixture(scope="module")
def merging_world(merging_model: IntersectionModel, empty_road: Scenario) -> World:
    return build_world(merging_model, empty_road)


def fork() -> list[Polyline]:
    """Two roads that part at (0, 0): straight on, and to the left on a circle of 10 m."""
    arc = [
        (10.0 * math.sin(turn), 10.0 * (1.0 - math.cos(turn)))
        for turn in np.radians(np.arange(0.0, 91.0, 3.0))
    ]
    straight = Polyline.from_points([(-50.0, 0.0), (50.0, 0.0)])
    return [straight, Polyline.from_points([(-40.0, 0.0), *arc, (10.0, 40.0)])]


def sharing_of(*lines: Polyline) -> Sharing:
    tables = np.array([sampled(line, 201) for line in lines])
    return sharing(list(lines), tables, VehicleDimensions(4.0, 2.0))


def test_vehicles_enter_beyond_the_start_distances_and_leave_40_m_behind_the_zone(
    crossing_world: World,
):
    # Start distances reach 80 m, 5 m more are out of reach; zones lie 100 m along the paths.
    assert crossing_world.paths.length_m == pytest.approx([125.0, 125.0])
    assert crossing_world.paths.zone_m == pytest.approx([85.0, 85.0])
    assert crossing_world.paths.exit_m == pytest.approx([88.0, 88.0])
    assert crossing_world.paths.shift_m == pytest.approx([-15.0, -15.0])


def test_a_longer_sensor_range_moves_the_entries_further_out(
    crossing_model: IntersectionModel, empty_road: Scenario
):
    world = build_world(crossing_model, replace(empty_road, sensor=Sensor(range_m=90.0)))
    assert world.paths.zone_m == pytest.approx([95.0, 95.0])


@pytest.mark.parametrize(
    ("path", "s", "pose"),
    [(0, 85.0, (0.0, 0.0, 0.0)), (0, 0.0, (-85.0, 0.0, 0.0)), (1, 90.2, (-5.2, 3.5, math.pi))],
)
def test_poses_on_the_paths_are_those_of_the_model(
    crossing_world: World, path: int, s: float, pose: tuple[float, float, float]
):
    assert table_pose(crossing_world.paths.table, path, s) == pytest.approx(pose, abs=1e-9)


def test_poses_go_straight_on_beyond_both_ends(crossing_world: World):
    assert table_pose(crossing_world.paths.table, 0, -2.0)[:2] == pytest.approx((-87.0, 0.0))
    assert table_pose(crossing_world.paths.table, 0, 200.0)[:2] == pytest.approx((115.0, 0.0))


def test_headings_on_a_curve_are_continuous(merging_world: World):
    headings = merging_world.paths.table[0, :, 2]
    assert headings[0] == pytest.approx(0.0, abs=1e-9)
    assert headings[-1] == pytest.approx(math.pi / 2.0)
    # Half a metre on a circle of 10 m is 0.05 rad; the corners of 5 degrees are smoothed.
    assert np.abs(np.diff(headings)).max() < 0.1


def test_distances_to_the_zone_count_down_along_the_path(crossing_world: World):
    matches = crossing_world.matches
    assert matches.lane.tolist() == [0, 1]
    # At the entry 85 m are left; until the zone's end, 3 m behind its centre, the lane matters.
    assert matches.distance_m == pytest.approx([85.0, 85.0])
    assert matches.change == pytest.approx([-1.0, -1.0])
    assert matches.high_m == pytest.approx([88.0, 88.0], abs=2e-3)
    assert matches.share == pytest.approx([1.0, 1.0])


def test_contact_is_possible_only_where_footprints_overlap(crossing_world: World):
    # A crossing at a right angle: half a length and half a width, 3 m, plus the margins of
    # 0.5 m and 0.25 m and at most two samples of half a metre.
    paths, ego = crossing_world.paths, crossing_world.ego
    for low, high in zip(paths.contact_low_m, paths.contact_high_m, strict=True):
        assert 85.0 - 4.75 <= low <= 85.0 - 3.0
        assert 85.0 + 3.0 <= high <= 85.0 + 4.75
    assert 100.0 - 4.75 <= ego.contact_low_m <= 100.0 - 3.0
    assert 103.5 + 3.0 <= ego.contact_high_m <= 103.5 + 4.75


def test_vehicles_beside_the_ego_on_their_own_lane_cannot_touch_it(
    crossing_model: IntersectionModel, empty_road: Scenario
):
    beside = Polyline.from_points([(-3.5, 60.0), (-3.5, -100.0)])
    lane = crossing_model.lanes[0]
    path = replace(lane.paths[0], path=replace(lane.paths[0].path, centerline=beside))
    model = replace(crossing_model, lanes=(replace(lane, paths=(path,)),))
    world = build_world(model, empty_road)
    assert world.paths.contact_low_m[0] == math.inf


def test_a_merging_vehicle_may_touch_the_ego_up_to_its_path_end(merging_world: World):
    assert merging_world.paths.contact_high_m[0] == math.inf


def test_the_ego_on_a_merging_path_is_where_the_join_puts_it(
    merging_world: World, merging_model: IntersectionModel
):
    shared = merging_world.ego_sharing
    # In the vehicles' lane from where the footprints can touch, for good.
    assert shared.from_m[0] == pytest.approx(104.0)
    assert shared.until_m[0] == math.inf
    s = 112.0 + shared.offset_m[0]
    x, y, _ = table_pose(merging_world.paths.table, 0, s)
    assert (x, y) == pytest.approx(merging_model.ego_path.centerline.position(112.0), abs=1e-6)


def test_nobody_follows_the_ego_on_crossing_paths(crossing_world: World):
    assert (crossing_world.ego_sharing.from_m == math.inf).all()


def test_two_lines_share_what_lies_before_their_fork():
    straight, left = fork()
    stretch = shared_stretch(straight, left, near_m=2.0)
    assert stretch is not None
    assert stretch.low_m == 0.0
    assert stretch.offset_m == pytest.approx(10.0)
    # On a circle of 10 m the lines are 0.15 m apart after 1.73 m and 2 m apart after 6.4 m.
    assert stretch.high_m == pytest.approx(41.73, abs=0.3)
    assert stretch.near_until_m == pytest.approx(46.4, abs=0.3)


def test_vehicles_before_and_just_behind_a_fork_are_on_both_roads():
    straight, left = fork()
    table = sharing_of(straight, left)
    assert table.low_m[0, 1] == -math.inf
    assert table.high_m[0, 1] == pytest.approx(46.4, abs=0.3)
    assert table.offset_m[0, 1] == pytest.approx(10.0)
    assert table.offset_m[1, 0] == pytest.approx(-10.0)
    assert (table.low_m[0, 0], table.high_m[0, 0], table.offset_m[0, 0]) == (-np.inf, np.inf, 0.0)


def test_vehicles_near_and_behind_a_join_are_on_both_roads():
    straight, left = fork()
    reverse = [Polyline.from_points(line.xy[::-1]) for line in (straight, left)]
    table = sharing_of(*reverse)
    # The joined part begins 50 - 1.73 m along the straight road.
    assert table.low_m[1, 0] == pytest.approx(50.0 - 1.73 - JOIN_VIEW_M, abs=0.3)
    assert table.high_m[1, 0] == math.inf


def test_who_follows_whom_changes_only_near_forks_and_joins():
    straight, left = fork()
    table = sharing_of(straight, left)
    # On the left road from the fork at 41.73 m to 46.4 m, and 10 m more either way.
    assert table.change_low_m[1] == pytest.approx(31.73, abs=0.3)
    assert table.change_high_m[1] == pytest.approx(56.4, abs=0.3)
    alone = sharing_of(straight)
    assert alone.change_low_m[0] == math.inf


def test_opposite_lanes_and_crossings_share_nothing():
    east = Polyline.from_points([(-50.0, 0.0), (50.0, 0.0)])
    west = Polyline.from_points([(50.0, 0.0), (-50.0, 0.0)])
    north = Polyline.from_points([(0.0, -50.0), (0.0, 50.0)])
    assert shared_stretch(east, west, 2.0) is None
    assert shared_stretch(east, north, 2.0) is None
    assert sharing_of(east, north).touches.all()
    beside = Polyline.from_points([(50.0, 3.5), (-50.0, 3.5)])
    assert sharing_of(east, beside).touches.tolist() == [[True, False], [False, True]]


def test_a_cut_line_is_the_part_between_two_arc_lengths():
    line = Polyline.from_points([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)])
    assert cut(line, 4.0, 13.0).xy.tolist() == [[4.0, 0.0], [10.0, 0.0], [10.0, 3.0]]
    assert cut(line, -5.0, 99.0).length_m == 20.0


def test_simplifying_keeps_corners_and_drops_what_lies_on_the_way():
    xy = np.array([(0.0, 0.0), (1.0, 0.01), (2.0, 0.0), (2.0, 5.0), (2.01, 7.0), (2.0, 9.0)])
    assert simplified(xy, 0.05) == [0, 2, 5]
    assert simplified(xy, 0.001) == [0, 1, 2, 3, 4, 5]


def test_sight_lines_run_from_the_zones_exit_to_the_sensor_range(crossing_world: World):
    sight = crossing_world.sight
    assert sight.points.tolist() == [2, 2]
    assert sight.distance_m[0] == pytest.approx([-3.0, 70.0])
    assert sight.xy[0].tolist() == [[3.0, 0.0], [-70.0, 0.0]]


def test_an_ego_that_cannot_start_far_enough_back_is_refused(
    crossing_model: IntersectionModel, empty_road: Scenario
):
    far = replace(empty_road, ego=EgoStart(distance_m=Interval(120.0, 150.0)))
    with pytest.raises(ScenarioError, match=r"\[120, 150\].*only 94\.0 m"):
        build_world(crossing_model, far)


def test_a_route_without_conflicts_is_refused(
    crossing_model: IntersectionModel, empty_road: Scenario
):
    with pytest.raises(NoConflictError, match="no intersecting lane"):
        build_world(replace(crossing_model, lanes=()), empty_road)
