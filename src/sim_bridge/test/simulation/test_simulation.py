# SPDX-License-Identifier: Apache-2.0
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import load_map
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.inputs import EgoPose, ObjectArrays
from sim_bridge.maps import shipped_map
from sim_bridge.scenarios.fields import EgoStart, Interval, Obstacles, Sensor
from sim_bridge.scenarios.loading import Scenario, load_scenario
from sim_bridge.simulation.simulation import Simulation

WithVehicles = Callable[..., Scenario]
STOP, SLOW, FAST = 0, 1, 2


def snapshot(simulation: Simulation, row: int) -> dict[str, list[float]]:
    """All that is known of one episode."""
    poses, figures = simulation.vehicle_poses(), simulation.statistics()
    situations = simulation.situations()
    found = {name: getattr(poses, name)[row][poses.mask[row]].tolist() for name in poses._fields}
    mask = situations.vehicle_mask[row]
    for name in situations._fields:
        values = getattr(situations, name)[row]
        found[name] = (values[mask] if name.startswith("vehicle") else values).tolist()
    for name in figures._fields:
        found[name] = getattr(figures, name)[row].tolist()
    found["ego"] = simulation.ego_poses()[row].tolist()
    found["obstacles"] = [corners.tolist() for corners in simulation.obstacles(row)]
    return found


def actions_of(seed: int, step: int) -> int:
    return (seed * 7 + step * step) % 3


@given(st.lists(st.integers(0, 2**63 - 1), min_size=1, max_size=6, unique=True), st.randoms())
@settings(max_examples=12)
def test_a_seed_is_the_same_episode_in_any_batch_and_order(
    crossing_model: IntersectionModel, busy: Scenario, seeds: list[int], random: object
):
    noisy = replace(busy, sensor=Sensor(velocity_noise_mps=1.0))
    alone = Simulation(crossing_model, noisy, 1)
    shuffled = list(seeds)
    random.shuffle(shuffled)
    together = Simulation(crossing_model, noisy, len(seeds))
    together.reset(np.array(shuffled))
    alone.reset([seeds[0]])
    row = shuffled.index(seeds[0])
    for step in range(30):
        assert snapshot(together, row) == snapshot(alone, 0)
        together.step([actions_of(seed, step) for seed in shuffled])
        alone.step([actions_of(seeds[0], step)])


def test_a_step_is_five_inner_steps(crossing_model: IntersectionModel, busy: Scenario):
    whole, parts = (Simulation(crossing_model, busy, 40) for _ in range(2))
    for simulation in (whole, parts):
        simulation.reset(np.arange(40))
    for step in range(60):
        actions = [actions_of(seed, step) for seed in range(40)]
        result = whole.step(actions)
        for _ in range(5):
            last = parts.inner_step(actions)
        assert result.terminated.tolist() == last.terminated.tolist()
        for row in range(0, 40, 9):
            assert snapshot(whole, row) == snapshot(parts, row)


def test_resetting_some_episodes_leaves_the_others_alone(
    crossing_model: IntersectionModel, busy: Scenario
):
    simulation = Simulation(crossing_model, busy, 3)
    simulation.reset([5, 6, 7])
    first = snapshot(simulation, 1)
    simulation.step([FAST, FAST, FAST])
    others = [snapshot(simulation, row) for row in (0, 2)]
    simulation.reset([0, 6, 0], mask=[False, True, False])
    assert snapshot(simulation, 1) == first
    assert [snapshot(simulation, row) for row in (0, 2)] == others


def at_line(scenario: Scenario, before_m: float = 0.0, speed_mps: float = 0.0) -> Scenario:
    start = EgoStart(Interval(before_m, before_m), Interval(speed_mps, speed_mps))
    return replace(scenario, ego=start)


def test_an_empty_road_is_crossed_in_the_computed_time(
    crossing_model: IntersectionModel, empty_road: Scenario
):
    simulation = Simulation(crossing_model, at_line(empty_road, 20.0, 5.0), 1)
    simulation.reset([1])
    # From 20 m before the line at 94 m to the goal at 120 m: 46 m at 5 m/s are 9.2 s, reached
    # within the 19th decision step.
    for step in range(1, 20):
        result = simulation.step([FAST])
        assert bool(result.reached_goal[0]) == (step == 19)
    assert (result.terminated[0], result.truncated[0], result.collided[0]) == (True, False, False)
    figures = simulation.statistics()
    assert figures.duration_s[0] == pytest.approx(9.2)
    assert figures.progress_m[0] == pytest.approx(46.0)
    assert figures.mean_speed_mps[0] == pytest.approx(5.0)
    assert figures.action_counts[0].tolist() == [0, 0, 19]
    assert figures.least_time_gap_s[0] == np.inf


def test_an_ego_that_never_leaves_is_timed_out_after_60_s_which_is_no_terminal_state(
    crossing_model: IntersectionModel, empty_road: Scenario
):
    simulation = Simulation(crossing_model, empty_road, 2)
    simulation.reset([1, 2])
    for _ in range(119):
        assert not simulation.step([STOP, STOP]).truncated.any()
    result = simulation.step([STOP, STOP])
    assert result.timed_out.all()
    assert result.truncated.all()
    assert not result.terminated.any()
    assert simulation.statistics().duration_s.tolist() == [60.0, 60.0]


def test_an_ended_episode_stays_as_it_is(crossing_model: IntersectionModel, busy: Scenario):
    simulation = Simulation(crossing_model, busy, 30)
    simulation.reset(np.arange(30))
    while not (result := simulation.step([FAST] * 30)).terminated[3]:
        pass
    end = snapshot(simulation, 3)
    assert result.ran[3]
    later = simulation.step([STOP] * 30)
    assert snapshot(simulation, 3) == end
    assert later.terminated[3]
    assert not later.ran[3]


def park(simulation: Simulation, path: int, s: float, speed: float = 0.0) -> None:
    """Put the only vehicle of a batch of one somewhere."""
    vehicles = simulation.state.vehicles
    vehicles.driving[0, 0], vehicles.waiting[0, 0] = True, False
    vehicles.path[0, 0], vehicles.s_m[0, 0], vehicles.speed_mps[0, 0] = path, s, speed
    vehicles.desired_speed_mps[0, 0] = max(speed, 0.01)


@pytest.fixture
def one_vehicle(
    crossing_model: IntersectionModel, empty_road: Scenario, with_vehicles: WithVehicles
) -> Simulation:
    simulation = Simulation(crossing_model, at_line(with_vehicles(empty_road, 1)), 1)
    simulation.reset([1])
    return simulation


def test_an_ego_that_drives_into_a_standing_vehicle_collides_when_the_footprints_meet(
    one_vehicle: Simulation,
):
    # It stands in the middle of the zone: contact once 3 m are left between the centres, 3 m
    # behind the stop position.
    park(one_vehicle, 0, one_vehicle.world.paths.zone_m[0])
    while not (result := one_vehicle.inner_step([FAST])).terminated[0]:
        pass
    assert result.collided[0]
    assert not result.reached_goal[0]
    assert 97.0 < one_vehicle.state.episodes.ego_s_m[0] <= 97.0 + 0.31


def test_a_vehicle_that_stands_just_beside_the_egos_way_is_passed(one_vehicle: Simulation):
    park(one_vehicle, 0, one_vehicle.world.paths.zone_m[0] - 3.3)
    one_vehicle.state.vehicles.desired_speed_mps[0, 0] = 1e-9
    while not (result := one_vehicle.step([FAST])).terminated[0]:
        pass
    assert result.reached_goal[0]


def test_others_do_not_brake_for_an_ego_in_their_zone(one_vehicle: Simulation):
    one_vehicle.state.episodes.ego_s_m[0] = 100.0
    one_vehicle.state.episodes.ego_speed_mps[0] = 0.0
    park(one_vehicle, 0, one_vehicle.world.paths.zone_m[0] - 20.0, speed=5.0)
    while not (result := one_vehicle.step([STOP])).terminated[0]:
        assert one_vehicle.state.vehicles.speed_mps[0, 0] == pytest.approx(5.0)
    assert result.collided[0]


def test_yielding_vehicles_stop_before_the_zone_for_an_ego_in_it(
    crossing_model: IntersectionModel, empty_road: Scenario, with_vehicles: WithVehicles
):
    polite = at_line(with_vehicles(empty_road, 1, yielding_share=1.0))
    simulation = Simulation(crossing_model, polite, 1)
    simulation.reset([1])
    simulation.state.episodes.ego_s_m[0] = 100.0
    park(simulation, 0, simulation.world.paths.zone_m[0] - 20.0, speed=5.0)
    for _ in range(60):
        result = simulation.step([STOP])
    assert not result.terminated[0]
    assert simulation.state.vehicles.speed_mps[0, 0] < 0.1
    assert simulation.state.vehicles.s_m[0, 0] < simulation.world.paths.zone_m[0] - 3.0


@pytest.mark.parametrize(("behind_m", "collides"), [(30.0, False), (8.0, True)])
def test_a_vehicle_follows_a_merged_ego_only_if_it_is_far_enough_behind(
    merging_model: IntersectionModel,
    empty_road: Scenario,
    with_vehicles: WithVehicles,
    behind_m: float,
    collides: bool,
):
    simulation = Simulation(merging_model, with_vehicles(empty_road, 1), 1)
    simulation.reset([1])
    # The ego creeps where the lanes have joined; the other one comes at 6 m/s. Room for stopping
    # is 30 - 4 - 2 m, but 8 - 4 - 2 m are less than 5^2 / (2 * 2).
    simulation.state.episodes.ego_s_m[0] = 111.0
    simulation.state.episodes.ego_speed_mps[0] = 1.0
    s = 111.0 + simulation.world.ego_sharing.offset_m[0] - behind_m
    park(simulation, 0, s, speed=6.0)
    for _ in range(30):
        result = simulation.step([SLOW])
    assert bool(result.collided[0]) == collides
    if not collides:
        assert simulation.state.vehicles.speed_mps[0, 0] == pytest.approx(1.0, abs=0.2)


def test_a_vehicle_that_once_followed_also_brakes_for_a_braking_ego(
    merging_model: IntersectionModel, empty_road: Scenario, with_vehicles: WithVehicles
):
    simulation = Simulation(merging_model, with_vehicles(empty_road, 1), 1)
    simulation.reset([1])
    simulation.state.episodes.ego_s_m[0] = 111.0
    simulation.state.episodes.ego_speed_mps[0] = 5.0
    park(simulation, 0, 111.0 + simulation.world.ego_sharing.offset_m[0] - 12.0, speed=5.0)
    simulation.step([FAST])
    for _ in range(30):
        result = simulation.step([STOP])
    assert not result.collided[0]
    assert simulation.state.vehicles.speed_mps[0, 0] < 0.2


def test_time_gaps_are_those_between_leaving_and_entering_a_zone(one_vehicle: Simulation):
    # At 5 m/s from the stop line: enters lane 10's zone (97 m) after 0.6 s and leaves it (103 m)
    # after 1.8 s. The vehicle, 24 m before its zone's start at 5 m/s, is then 4.8 - 1.8 s off.
    one_vehicle.state.episodes.ego_speed_mps[0] = 5.0
    park(one_vehicle, 0, one_vehicle.world.paths.zone_m[0] - 27.0, speed=5.0)
    while not one_vehicle.step([FAST]).terminated[0]:
        pass
    # The ego has left within the inner step before 1.9 s.
    assert one_vehicle.statistics().least_time_gap_s[0] == pytest.approx(3.0, abs=0.11)


def test_the_time_gap_behind_a_vehicle_counts_from_its_leaving(one_vehicle: Simulation):
    # It leaves its zone after 0.2 s, the ego enters after 0.6 s.
    one_vehicle.state.episodes.ego_speed_mps[0] = 5.0
    park(one_vehicle, 0, one_vehicle.world.paths.exit_m[0] - 1.0, speed=5.0)
    while not one_vehicle.step([FAST]).terminated[0]:
        pass
    assert one_vehicle.statistics().least_time_gap_s[0] == pytest.approx(0.4, abs=0.11)


def test_actions_changes_and_hard_brakes_are_counted_in_decision_steps(
    crossing_model: IntersectionModel, empty_road: Scenario
):
    simulation = Simulation(crossing_model, at_line(empty_road, 50.0, 5.0), 1)
    simulation.reset([1])
    # From 5 m/s: Stop takes 1.75 m/s, Slow 1.75 and then 0.5 m/s, which is not hard.
    for action in (FAST, STOP, SLOW, SLOW, SLOW, FAST):
        simulation.step([action])
    figures = simulation.statistics()
    assert figures.action_counts[0].tolist() == [1, 3, 2]
    assert figures.action_changes[0] == 3
    assert figures.hard_brakes[0] == 2


def test_a_hidden_vehicle_is_absent_from_the_situation_but_not_from_the_truth(
    crossing_model: IntersectionModel, empty_road: Scenario, with_vehicles: WithVehicles
):
    walls = Obstacles(
        length_m=Interval(12.0, 12.0),
        width_m=Interval(12.0, 12.0),
        gap_ego_m=Interval(1.0, 1.0),
        gap_cross_m=Interval(1.0, 1.0),
    )
    scenario = replace(at_line(with_vehicles(empty_road, 1), 20.0), obstacles=walls)
    simulation = Simulation(crossing_model, scenario, 1)
    simulation.reset([1])
    park(simulation, 0, simulation.world.paths.zone_m[0] - 20.0)
    assert not simulation.situations().vehicle_mask.any()
    poses = simulation.vehicle_poses()
    assert poses.mask[0, 0]
    assert poses.hidden[0, 0]
    # Right before the ego's lane it is seen.
    park(simulation, 0, simulation.world.paths.zone_m[0] - 1.0)
    situations = simulation.situations()
    assert situations.vehicle_mask.sum() == 1
    assert situations.vehicle_distance_m[0, 0] == pytest.approx(1.0)
    assert situations.lane_id[0, situations.vehicle_lane[0, 0]] == 10
    assert not simulation.vehicle_poses().hidden[0, 0]


def test_vehicles_out_of_range_are_absent(one_vehicle: Simulation):
    # From the ego at (0, -6) the range of 70 m ends at x = -69.74 on y = 0.
    for before, seen in [(69.7, True), (69.8, False)]:
        park(one_vehicle, 0, one_vehicle.world.paths.zone_m[0] - before)
        assert one_vehicle.situations().vehicle_mask.any() == seen


def test_a_sensor_further_ahead_sees_more(crossing_model: IntersectionModel, base: Scenario):
    hidden = []
    for offset in (0.0, 2.0):
        scenario = replace(at_line(base), sensor=Sensor(forward_offset_m=offset))
        simulation = Simulation(crossing_model, scenario, 50)
        simulation.reset(np.arange(50))
        hidden.append(simulation.situations().lane_hidden_distance_m)
    assert (hidden[1] >= hidden[0] - 1e-9).all()
    assert (hidden[1] > hidden[0] + 1.0).any()


def test_speed_errors_are_normal_and_the_same_however_often_one_looks(
    crossing_model: IntersectionModel, busy: Scenario
):
    noisy = replace(busy, sensor=Sensor(velocity_noise_mps=1.0))
    simulation = Simulation(crossing_model, noisy, 200)
    simulation.reset(np.arange(200))
    poses = simulation.vehicle_poses()
    errors = (poses.measured_speed_mps - poses.speed_mps)[poses.mask]
    assert errors.mean() == pytest.approx(0.0, abs=0.1)
    assert errors.std() == pytest.approx(1.0, abs=0.08)
    again = simulation.vehicle_poses()
    assert np.array_equal(again.measured_speed_mps, poses.measured_speed_mps)
    simulation.inner_step([STOP] * 200)
    later = simulation.vehicle_poses()
    fresh = (later.measured_speed_mps - later.speed_mps)[poses.mask]
    assert abs(np.corrcoef(errors, fresh)[0, 1]) < 0.15


@pytest.mark.parametrize("model_name", ["crossing_model", "merging_model"])
def test_batches_see_what_the_situation_node_would_make_of_the_same_objects(
    request: pytest.FixtureRequest, model_name: str, busy: Scenario
):
    model = request.getfixturevalue(model_name)
    simulation = Simulation(model, busy, 12)
    simulation.reset(np.arange(12))
    builder = SituationBuilder(model)
    for step in range(30):
        situations = simulation.situations()
        poses, egos = simulation.vehicle_poses(), simulation.ego_poses()
        row = step % 12
        seen = poses.mask[row] & ~poses.hidden[row]
        size = np.zeros(int(seen.sum()))
        objects = ObjectArrays(
            poses.id[row, seen],
            poses.x_m[row, seen],
            poses.y_m[row, seen],
            poses.heading_rad[row, seen],
            poses.measured_speed_mps[row, seen],
            size,
            size,
        )
        built = builder.build(EgoPose(*egos[row]), objects, simulation.visible_area(row))
        found = sorted_vehicles(situations, row)
        expected = sorted_vehicles(built, 0)
        assert found[:, :2].tolist() == expected[:, :2].tolist()
        # The matching is kept in pieces that may be off by a centimetre or two.
        assert found[:, 2:] == pytest.approx(expected[:, 2:], abs=0.02)
        for name in built._fields:
            if not name.startswith("vehicle"):
                values, other = getattr(situations, name)[row], getattr(built, name)[0]
                assert values == pytest.approx(other, abs=0.02), name
        simulation.step([actions_of(seed, step) for seed in range(12)])


def sorted_vehicles(situations: object, row: int) -> np.ndarray:
    names = ("vehicle_id", "vehicle_lane", "vehicle_distance_m", "vehicle_speed_mps")
    mask = situations.vehicle_mask[row]
    table = np.column_stack([getattr(situations, name)[row, mask] for name in names])
    return table[np.lexsort((table[:, 1], table[:, 0]))]


def test_situations_may_be_written_over_earlier_ones(
    crossing_model: IntersectionModel, busy: Scenario
):
    simulation = Simulation(crossing_model, busy, 20)
    simulation.reset(np.arange(20))
    kept = simulation.situations()
    simulation.step([FAST] * 20)
    fresh = simulation.situations()
    assert simulation.situations(out=kept) is kept
    for name in kept._fields:
        mask = kept.vehicle_mask if name.startswith("vehicle") else slice(None)
        assert np.array_equal(getattr(kept, name)[mask], getattr(fresh, name)[mask]), name


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda s: s.reset([1]), "seeds has shape"),
        (lambda s: s.reset([1, 2], [True]), "mask has shape"),
        (lambda s: s.step([0]), "actions has shape"),
        (lambda s: s.step([0, 3]), "actions range from 0 to 3"),
        (lambda s: s.step([-1, 0]), "actions range from -1 to 0"),
    ],
)
def test_wrong_input_is_named(
    crossing_model: IntersectionModel,
    empty_road: Scenario,
    call: Callable[[Simulation], object],
    words: str,
):
    with pytest.raises(ConfigurationError, match=words):
        call(Simulation(crossing_model, empty_road, 2))


def test_an_empty_batch_is_refused(crossing_model: IntersectionModel, empty_road: Scenario):
    with pytest.raises(ConfigurationError, match="batch is 0"):
        Simulation(crossing_model, empty_road, 0)


@pytest.mark.parametrize("name", ["t_junction", "roundabout"])
def test_no_hidden_vehicle_is_nearer_than_the_distance_from_which_one_may_hide(
    name: str, with_vehicles: WithVehicles
):
    place = shipped_map(name)
    model = build_intersection(load_map(place.path, place.origin), place.route)
    simulation = Simulation(model, with_vehicles(load_scenario("severe_occlusion"), 8), 30)
    simulation.reset(np.arange(30))
    vehicles, world = simulation.state.vehicles, simulation.world
    checked = 0
    for _ in range(60):
        hidden_m = simulation.situations().lane_hidden_distance_m
        poses = simulation.vehicle_poses()
        lane = world.paths.lane[vehicles.path]
        distance = world.paths.zone_m[vehicles.path] - vehicles.s_m
        coming = poses.hidden & (distance > -0.5 * world.lanes.zone_m[lane])
        least = np.take_along_axis(hidden_m, lane, axis=1)
        # Sight lines are off their curves by 5 cm at most.
        assert (distance[coming] >= least[coming] - 0.1).all()
        checked += int(coming.sum())
        simulation.step(np.full(30, SLOW))
    assert checked > 1000
