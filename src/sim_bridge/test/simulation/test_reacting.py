# SPDX-License-Identifier: Apache-2.0
"""Others that brake for an ego in their way, some time after they could first see it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from risk_dqn_planner.errors import ScenarioError
from risk_dqn_planner.intersection.model import IntersectionModel
from sim_bridge.evaluation.clairvoyant import require_indifferent
from sim_bridge.scenarios.fields import Interval, Obstacles, Scenario
from sim_bridge.scenarios.loading import load_scenario
from sim_bridge.simulation.reacting import in_the_way
from sim_bridge.simulation.simulation import Simulation

WithVehicles = Callable[..., Scenario]
STOP, SLOW, FAST = 0, 1, 2
WALLS = Obstacles(
    length_m=Interval(12.0, 12.0),
    width_m=Interval(12.0, 12.0),
    gap_ego_m=Interval(1.0, 1.0),
    gap_cross_m=Interval(1.0, 1.0),
)


@pytest.mark.parametrize(
    ("distance", "speed", "expected"),
    [
        (0.0, 0.0, True),  # stands in the zone, of 3 m to either side
        (-2.9, 0.0, True),
        (-3.0, 5.0, False),  # has left
        (3.1, 0.0, False),  # stands before it
        (7.9, 5.0, True),  # enters within a second
        (8.1, 5.0, False),
        (3.9, 1.0, True),
        (4.1, 1.0, False),
    ],
)
def test_the_ego_is_in_the_way_inside_of_the_zone_and_a_second_before(
    distance: float, speed: float, expected: bool
) -> None:
    assert in_the_way(distance, 3.0, speed) == expected


@pytest.fixture
def reacting(empty_road: Scenario, with_vehicles: WithVehicles) -> Scenario:
    """One vehicle that brakes a second after it sees the ego; no obstacles."""
    return with_vehicles(empty_road, 1, brakes_for_ego_after_s=1.0)


def meeting(
    model: IntersectionModel, scenario: Scenario, ego_m: float, before_m: float, mps: float
) -> Simulation:
    """The ego stands somewhere, and a vehicle comes so far before the zone of lane 10."""
    simulation = Simulation(model, scenario, 1)
    simulation.reset([1])
    episodes, vehicles, _ = simulation.state
    episodes.ego_s_m[0], episodes.ego_speed_mps[0] = ego_m, 0.0
    vehicles.driving[0, 0], vehicles.waiting[0, 0], vehicles.path[0, 0] = True, False, 0
    begin_m = simulation.world.paths.exit_m[0] - simulation.world.lanes.zone_m[0]
    vehicles.s_m[0, 0] = begin_m - before_m
    vehicles.speed_mps[0, 0] = vehicles.desired_speed_mps[0, 0] = mps
    return simulation


def speeds(simulation: Simulation, steps: int) -> list[float]:
    """The vehicle's speed after each inner step while the ego stands."""
    return [
        (simulation.inner_step([STOP]), float(simulation.state.vehicles.speed_mps[0, 0]))[1]
        for _ in range(steps)
    ]


def test_a_driver_brakes_one_time_of_reaction_after_it_sees_the_ego(
    crossing_model: IntersectionModel, reacting: Scenario
) -> None:
    # 14 m are 7 for a second's way and 7^2 / (2 * 4) = 6.1 to stop; then it brakes at its hardest.
    found = speeds(meeting(crossing_model, reacting, 100.0, 14.0, 7.0), 12)
    assert found[:10] == [7.0] * 10
    assert found[10:] == pytest.approx([6.6, 6.2])


@pytest.mark.parametrize("mps", [3.0, 5.0, 7.0])
@pytest.mark.parametrize("further_m", [0.2, 5.0, 40.0])
def test_who_sees_the_ego_in_time_comes_to_rest_before_the_zone(
    crossing_model: IntersectionModel, reacting: Scenario, mps: float, further_m: float
) -> None:
    needed_m = mps * 1.0 + mps * mps / (2.0 * 4.0)
    simulation = meeting(crossing_model, reacting, 100.0, needed_m + further_m, mps)
    before = mps
    for speed in speeds(simulation, 300):
        assert before - speed <= 0.4 + 1e-9
        before = speed
    assert not simulation.state.episodes.collided[0]
    assert before < 0.1
    paths = simulation.world.paths
    assert simulation.state.vehicles.s_m[0, 0] < paths.exit_m[0] - 6.0


def test_who_sees_it_too_late_brakes_and_collides_more_slowly(
    crossing_model: IntersectionModel, reacting: Scenario
) -> None:
    # A second takes 7 m; in the other 4 m it slows down to sqrt(49 - 2 * 4 * 4) = 4.1 m/s.
    simulation = meeting(crossing_model, reacting, 100.0, 11.0, 7.0)
    while not simulation.inner_step([STOP]).terminated[0]:
        pass
    assert simulation.state.episodes.collided[0]
    assert simulation.state.vehicles.speed_mps[0, 0] == pytest.approx(4.1, abs=0.4)


def test_nobody_brakes_for_an_ego_that_waits_at_the_line(
    crossing_model: IntersectionModel, reacting: Scenario
) -> None:
    assert set(speeds(meeting(crossing_model, reacting, 94.0, 20.0, 7.0), 60)) == {7.0}


def test_who_does_not_see_the_ego_does_not_brake_and_once_seen_it_is_not_forgotten(
    crossing_model: IntersectionModel, reacting: Scenario
) -> None:
    hidden = replace(reacting, obstacles=WALLS)
    # The ego has just entered the zone; walls end 2.75 m from the lanes' middles, so that vehicles
    # are hidden from x = 0, y = -2.99 that are more than 34 m away.
    simulation = meeting(crossing_model, hidden, 97.01, 60.0, 7.0)
    seen = [
        bool((simulation.inner_step([STOP]), simulation.vehicle_poses())[1].hidden[0, 0])
        for _ in range(10)
    ]
    assert all(seen)
    assert simulation.state.vehicles.speed_mps[0, 0] == 7.0
    assert simulation.lags.noticed[0, 0] == -1
    # In the open it would have known the ego for a second.
    assert speeds(meeting(crossing_model, reacting, 97.01, 60.0, 7.0), 12)[-1] < 7.0
    # One that knows of the ego goes on knowing behind the wall.
    simulation.lags.noticed[0, 0] = 3
    speeds(simulation, 1)
    assert simulation.lags.noticed[0, 0] == 4


def test_a_driver_goes_on_once_the_ego_is_out_of_its_way(
    crossing_model: IntersectionModel, reacting: Scenario
) -> None:
    simulation = meeting(crossing_model, reacting, 100.0, 30.0, 7.0)
    speeds(simulation, 200)
    simulation.state.episodes.ego_s_m[0] = 110.0
    assert speeds(simulation, 20)[-1] > 2.0
    assert simulation.lags.noticed[0, 0] == -1


def test_braking_traffic_collides_less_with_a_reckless_ego_and_combines_with_any_scenario(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    collisions = []
    for after_s in (None, 1.0, 0.0):
        traffic = replace(busy.traffic, brakes_for_ego_after_s=after_s)
        scenario = replace(load_scenario("close_small_obstacle"), traffic=traffic)
        simulation = Simulation(crossing_model, scenario, 400)
        simulation.reset(np.arange(400))
        for _ in range(40):
            result = simulation.step([FAST] * 400)
        collisions.append(int(result.collided.sum()))
    never, late, at_once = collisions
    assert never > 1.1 * late
    assert late > 1.5 * at_once


def test_there_is_no_clairvoyant_for_traffic_that_brakes_nor_for_a_delayed_ego(
    crossing_model: IntersectionModel, reacting: Scenario, empty_road: Scenario
) -> None:
    require_indifferent(Simulation(crossing_model, empty_road, 1))
    with pytest.raises(ScenarioError, match="brake for the ego"):
        require_indifferent(Simulation(crossing_model, reacting, 1))
    delayed = replace(empty_road, ego=replace(empty_road.ego, actuation_delay_s=0.2))
    with pytest.raises(ScenarioError, match=r"take effect 0\.2 s later"):
        require_indifferent(Simulation(crossing_model, delayed, 1))
