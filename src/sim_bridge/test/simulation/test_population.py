# SPDX-License-Identifier: Apache-2.0
import copy
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from risk_dqn_planner.geometry.footprint import footprints_overlap
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import load_map
from risk_dqn_planner.situation.situations import Floats
from sim_bridge.maps import shipped_map
from sim_bridge.scenarios.fields import EgoStart, Interval, Obstacles, Sensor
from sim_bridge.scenarios.loading import Scenario
from sim_bridge.simulation.population import first_waiting, has_room, let_one_in, replace_those_gone
from sim_bridge.simulation.simulation import Simulation
from sim_bridge.simulation.traffic import find_leaders
from sim_bridge.world.path_geometry import cut

WithVehicles = Callable[..., Scenario]
STOP = 0
# Put on leaders that nobody should look for again.
MARK = 1000


def started(model: IntersectionModel, scenario: Scenario, batch: int = 200) -> Simulation:
    simulation = Simulation(model, scenario, batch)
    simulation.reset(np.arange(batch))
    return simulation


def overlaps(poses: Floats) -> int:
    """How many pairs of footprints (K, 3) overlap."""
    return sum(
        bool(footprints_overlap(*a, 4.0, 2.0, *b, 4.0, 2.0)) for a, b in combinations(poses, 2)
    )


def placed(simulation: Simulation, episode: int) -> Floats:
    poses = simulation.vehicle_poses()
    mask = poses.mask[episode]
    columns = (poses.x_m, poses.y_m, poses.heading_rad)
    return np.column_stack([column[episode, mask] for column in columns])


@pytest.fixture(scope="module")
def crowd(merging_model: IntersectionModel, crossing_model: IntersectionModel, base: Scenario):
    """Twelve vehicles on four paths, some of which cross each other."""
    everything = replace(
        crossing_model, lanes=(*crossing_model.lanes, *merging_model.lanes), goal_m=130.0
    )
    traffic = replace(base.traffic, vehicles=Interval(12, 12), headway_s=0.0)
    return started(everything, replace(base, traffic=traffic))


def test_no_two_vehicles_overlap_when_an_episode_begins(crowd: Simulation):
    assert crowd.state.vehicles.driving.sum() > 8 * crowd.batch
    for episode in range(crowd.batch):
        assert overlaps(placed(crowd, episode)) == 0


def test_who_finds_no_place_waits_to_come_in(crowd: Simulation):
    vehicles = crowd.state.vehicles
    assert (vehicles.driving ^ vehicles.waiting).all()
    assert vehicles.waiting.any()


def test_vehicles_start_within_their_distances_at_their_desired_speed(crowd: Simulation):
    vehicles, paths = crowd.state.vehicles, crowd.world.paths
    distance = (paths.zone_m[vehicles.path] - vehicles.s_m)[vehicles.driving]
    assert (distance >= 10.0).all()
    assert (distance <= 80.0).all()
    assert distance.min() < 11.0
    assert distance.max() > 79.0
    assert (vehicles.speed_mps == vehicles.desired_speed_mps)[vehicles.driving].all()
    assert ((vehicles.desired_speed_mps >= 3.5) & (vehicles.desired_speed_mps <= 7.0)).all()


def test_every_lane_gets_its_share_of_the_traffic(crowd: Simulation):
    lanes = crowd.world.paths.lane[crowd.state.vehicles.path]
    # 2400 vehicles on 3 lanes: 800 each, with a standard deviation of 23.
    assert (np.abs(np.bincount(lanes.ravel()) - 800) < 100).all()


def test_desired_speeds_are_cut_to_the_speed_limit(
    crossing_model: IntersectionModel, busy: Scenario
):
    slow = tuple(replace(lane, speed_limit_mps=4.0) for lane in crossing_model.lanes)
    simulation = started(replace(crossing_model, lanes=slow), busy)
    assert simulation.state.vehicles.desired_speed_mps.max() == 4.0


def test_the_ego_starts_within_its_distances_before_the_stop_line(
    crossing_model: IntersectionModel, empty_road: Scenario
):
    scenario = replace(empty_road, ego=EgoStart(Interval(20.0, 50.0), Interval(2.0, 4.0)))
    episodes = started(crossing_model, scenario).state.episodes
    before = 94.0 - episodes.ego_s_m
    assert 20.0 <= before.min() < 21.0
    assert 49.0 < before.max() <= 50.0
    assert 2.0 <= episodes.ego_speed_mps.min() < 2.1
    assert 3.9 < episodes.ego_speed_mps.max() <= 4.0


def test_the_number_of_vehicles_is_drawn_from_its_interval(
    crossing_model: IntersectionModel, base: Scenario
):
    vehicles = started(crossing_model, base, batch=300).state.vehicles
    counts = (vehicles.driving | vehicles.waiting).sum(axis=1)
    # Six values, 50 each on average, with a standard deviation of 6.5.
    assert sorted(set(counts.tolist())) == [1, 2, 3, 4, 5, 6]
    assert np.bincount(counts)[1:].min() > 25


def test_obstacles_are_picked_for_each_side_on_its_own(
    crossing_model: IntersectionModel, base: Scenario
):
    two = replace(base, obstacles=Obstacles(per_side=2))
    obstacle = started(crossing_model, two).state.episodes.obstacle
    assert obstacle.shape == (200, 4)
    assert (obstacle >= 0).all()
    assert len(np.unique(obstacle)) > 200
    assert len({tuple(row) for row in obstacle}) > 195


def room(simulation: Simulation, path: int, s: float, headway_s: float) -> bool:
    """Whether there is room for a second vehicle that wants to drive at 4 m/s."""
    settings = simulation.settings
    settings = settings._replace(draws=settings.draws._replace(headway_s=headway_s))
    world, vehicles = simulation.world, simulation.state.vehicles
    return has_room(0, 1, path, s, 4.0, settings, world.paths, world.sharing, vehicles)


@pytest.mark.parametrize(
    ("s", "free"),
    [
        # The other one stands at 50 m. Its length and the standstill gap are 6 m; 1.5 s at the
        # own 4 m/s are 6 m more, and at the other's 6 m/s, when it follows, 9 m.
        (37.9, True),
        (38.1, False),
        (50.0, False),
        (64.9, False),
        (65.1, True),
    ],
)
def test_room_for_a_vehicle_is_the_standstill_gap_and_the_followers_headway(
    crossing_model: IntersectionModel,
    with_vehicles: WithVehicles,
    base: Scenario,
    s: float,
    free: bool,
):
    simulation = started(crossing_model, with_vehicles(base, 2), batch=1)
    vehicles = simulation.state.vehicles
    vehicles.driving[0] = [True, False]
    vehicles.path[0] = 0
    vehicles.s_m[0, 0], vehicles.speed_mps[0, 0] = 50.0, 6.0
    assert room(simulation, 0, s, headway_s=1.5) == free


def test_there_is_no_room_where_another_lane_crosses_an_occupied_place(
    crossing_model: IntersectionModel, merging_model: IntersectionModel, busy: Scenario
):
    both = replace(crossing_model, lanes=(crossing_model.lanes[1], *merging_model.lanes))
    simulation = started(both, busy, batch=1)
    world, vehicles = simulation.world, simulation.state.vehicles
    vehicles.driving[0] = [True] + [False] * 5
    # One on the lane from the east, right where the turning lane crosses it.
    vehicles.path[0, 0] = 0
    crossing = world.paths.table[1]
    s = 0.5 * int(np.abs(crossing[:, 1] - 3.5).argmin())
    vehicles.s_m[0, 0] = world.paths.zone_m[0] - crossing[int(2 * s), 0]
    assert not room(simulation, 1, s, headway_s=0.0)
    vehicles.s_m[0, 0] = 0.0
    assert room(simulation, 1, s, headway_s=0.0)


def drive_on(simulation: Simulation, steps: int) -> set[tuple[int, int]]:
    """Let the egos stand; return the (episode, id) of all vehicles that appeared."""
    seen = set()
    for _ in range(steps):
        vehicles = simulation.state.vehicles
        rows, places = np.nonzero(vehicles.driving | vehicles.waiting)
        seen |= set(zip(rows.tolist(), vehicles.id[rows, places].tolist(), strict=True))
        simulation.step(np.full(simulation.batch, STOP))
    return seen


def test_vehicles_that_left_come_again_as_new_ones(
    crossing_model: IntersectionModel, busy: Scenario
):
    simulation = started(crossing_model, busy, batch=20)
    seen = drive_on(simulation, 100)
    vehicles = simulation.state.vehicles
    assert (vehicles.driving | vehicles.waiting).all()
    for episode in range(20):
        ids = sorted(i for row, i in seen if row == episode)
        # Every place was taken anew at least once, and no number was used twice.
        assert ids == list(range(1, len(ids) + 1))
        assert len(ids) >= 12
        assert len(set(vehicles.id[episode])) == 6


def test_new_vehicles_enter_at_the_start_of_their_path(
    crossing_model: IntersectionModel, busy: Scenario
):
    simulation = started(crossing_model, busy, batch=50)
    known = simulation.state.vehicles.id.copy()
    entered = 0
    for _ in range(60):
        simulation.step(np.full(50, STOP))
        vehicles = simulation.state.vehicles
        new = vehicles.driving & (vehicles.id != known)
        # Within half a second, five inner steps, from the entry.
        assert (vehicles.s_m[new] <= 3.5 + 1e-9).all()
        entered += int(new.sum())
        known[new] = vehicles.id[new]
    assert entered > 100


def test_finite_traffic_runs_out(
    crossing_model: IntersectionModel, busy: Scenario, with_vehicles: WithVehicles
):
    simulation = started(crossing_model, with_vehicles(busy, 6, respawn=False), batch=20)
    seen = drive_on(simulation, 115)
    assert len(seen) == 20 * 6
    assert not (simulation.state.vehicles.driving | simulation.state.vehicles.waiting).any()


def test_vehicles_of_one_lane_never_touch_while_they_follow_each_other(
    crossing_model: IntersectionModel, with_vehicles: WithVehicles, base: Scenario
):
    simulation = started(crossing_model, with_vehicles(base, 10, headway_s=0.8), batch=30)
    for _ in range(80):
        simulation.step(np.full(30, STOP))
        vehicles = simulation.state.vehicles
        for episode in range(30):
            for path in (0, 1):
                there = vehicles.driving[episode] & (vehicles.path[episode] == path)
                gaps = np.diff(np.sort(vehicles.s_m[episode, there])) - 4.0
                assert (gaps > 0.5).all()


def test_nobody_appears_on_a_short_path_while_the_ego_sees_its_beginning(
    crossing_model: IntersectionModel, with_vehicles: WithVehicles, empty_road: Scenario
):
    # Both lanes begin only 40 m before their zones, which an ego near the line sees well.
    lanes = tuple(
        replace(
            lane,
            paths=tuple(
                replace(
                    path,
                    path=replace(path.path, centerline=cut(path.path.centerline, 60.0, 160.0)),
                    zone_center_m=40.0,
                )
                for path in lane.paths
            ),
        )
        for lane in crossing_model.lanes
    )
    short = replace(crossing_model, lanes=lanes)
    at_line = EgoStart(Interval(0.0, 0.0), Interval(0.0, 0.0))
    for range_m, appears in [(70.0, False), (30.0, True)]:
        scenario = replace(with_vehicles(empty_road, 4), sensor=Sensor(range_m=range_m))
        simulation = started(short, replace(scenario, ego=at_line), batch=10)
        drive_on(simulation, 80)
        assert simulation.state.vehicles.driving.any() == appears
        assert (simulation.state.vehicles.waiting | simulation.state.vehicles.driving).all()


@pytest.mark.parametrize("name", ["t_junction", "multi_lane"])
def test_leaders_found_only_when_due_are_those_found_every_time(
    name: str, with_vehicles: WithVehicles, base: Scenario
):
    place = shipped_map(name)
    model = build_intersection(load_map(place.path, place.origin), place.route)
    simulation = started(model, with_vehicles(base, 8, headway_s=0.5), batch=20)
    world, (episodes, vehicles, _) = simulation.world, simulation.state
    followers = searches_spared = 0
    for _ in range(100):
        replace_those_gone(world.paths, world.lanes, simulation.settings.draws, episodes, vehicles)
        let_one_in(
            world.ego,
            world.paths,
            world.sharing,
            world.obstacles.corners,
            simulation.settings,
            episodes,
            vehicles,
            np.zeros((20, 2, 4, 3)),
        )
        every_time = copy.deepcopy(vehicles)
        every_time.leader_due[:] = True
        find_leaders(world.sharing, episodes, every_time)
        vehicles.leader[vehicles.driving & ~vehicles.leader_due] += MARK
        find_leaders(world.sharing, episodes, vehicles)
        spared = vehicles.driving & (vehicles.leader > MARK // 2)
        vehicles.leader[spared] -= MARK
        driving = vehicles.driving
        assert np.array_equal(vehicles.leader[driving], every_time.leader[driving])
        followed = (vehicles.leader >= 0) & driving
        offsets = (vehicles.leader_offset_m, every_time.leader_offset_m)
        assert np.array_equal(*(offset[followed] for offset in offsets))
        followers += int(followed.sum())
        searches_spared += int(spared.sum())
        simulation.step(np.full(20, STOP))
    assert followers > 1000
    assert searches_spared > 1000


@pytest.mark.parametrize(
    ("waiting", "turn", "chosen"),
    [
        ([0, 0, 0, 0], 1, -1),
        ([1, 0, 1, 0], 0, 0),
        ([1, 0, 1, 0], 1, 2),
        ([1, 0, 1, 0], 3, 0),
        ([1, 0, 1, 0], 6, 2),
        ([0, 0, 1, 1], 3, 3),
    ],
)
def test_waiting_vehicles_come_in_by_turns(waiting: list[int], turn: int, chosen: int):
    assert first_waiting(np.array([waiting], dtype=np.bool_), 0, turn) == chosen
