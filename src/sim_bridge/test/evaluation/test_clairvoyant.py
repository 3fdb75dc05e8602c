# SPDX-License-Identifier: Apache-2.0
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from risk_dqn_planner.errors import ScenarioError
from risk_dqn_planner.intersection.model import IntersectionModel
from sim_bridge.environment.episodes import drive
from sim_bridge.environment.interface import Outcome
from sim_bridge.evaluation import clairvoyant
from sim_bridge.evaluation.bounds import Rules, lower_bounds, speeds_from
from sim_bridge.evaluation.clairvoyant import ClairvoyantPolicy, Optima, film, optima
from sim_bridge.evaluation.known import KnownOptima
from sim_bridge.evaluation.search import IMPOSSIBLE
from sim_bridge.scenarios.fields import EgoStart, Interval, Obstacles, Timing
from sim_bridge.scenarios.loading import Scenario
from sim_bridge.simulation.settings import EgoDrive
from sim_bridge.simulation.simulation import Simulation

DECISIONS = 8
SEEDS = np.arange(40)


@pytest.fixture(scope="module")
def near_goal(crossing_model: IntersectionModel) -> IntersectionModel:
    """The goal is 13 m behind the stop line, which eight decisions reach with time to spare."""
    return replace(crossing_model, goal_m=107.0)


@pytest.fixture(scope="module")
def short(base: Scenario) -> Scenario:
    """Episodes of 4 s that begin just before crossing traffic."""
    return replace(
        base,
        ego=EgoStart(distance_m=Interval(0.5, 2.0), speed_mps=Interval(3.0, 5.0)),
        traffic=replace(
            base.traffic, vehicles=Interval(4, 6), start_distance_m=Interval(5.0, 40.0)
        ),
        obstacles=Obstacles(per_side=0),
        timing=Timing(limit_s=0.5 * DECISIONS),
    )


def tried_out(model: IntersectionModel, scenario: Scenario, seed: int) -> int:
    """Inner steps of the best of all action sequences, each driven in the simulation."""
    sequences = np.array(list(itertools.product(range(3), repeat=DECISIONS)))
    simulation = Simulation(model, scenario, len(sequences))
    simulation.reset(np.full(len(sequences), seed))
    for step in range(DECISIONS):
        simulation.step(sequences[:, step])
    reached = simulation.state.episodes.reached_goal
    return int(simulation.state.episodes.tick[reached].min()) if reached.any() else IMPOSSIBLE


def solved(model: IntersectionModel, scenario: Scenario, seeds: np.ndarray) -> Optima:
    return optima(Simulation(model, scenario, len(seeds)), seeds)


def test_finds_what_trying_out_every_sequence_finds(
    near_goal: IntersectionModel, short: Scenario
) -> None:
    expected = [tried_out(near_goal, short, seed) for seed in SEEDS]
    found = solved(near_goal, short, SEEDS)
    np.testing.assert_array_equal(found.steps, expected)
    assert found.proven.all()
    # The cases hold what makes them worth comparing.
    assert IMPOSSIBLE in expected
    assert len(set(expected)) > 3


def test_with_bounds_from_the_traffic_it_finds_the_same(
    near_goal: IntersectionModel, short: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = solved(near_goal, short, SEEDS)
    # Nothing counts as easy any more, so that each episode takes the long way.
    monkeypatch.setattr(clairvoyant, "_EASY_STATES", 0)
    found = solved(near_goal, short, SEEDS)
    np.testing.assert_array_equal(found.steps, expected.steps)
    assert found.proven.all()


def test_the_bounds_never_exceed_the_optimum(near_goal: IntersectionModel, short: Scenario) -> None:
    simulation = Simulation(near_goal, short, len(SEEDS))
    steps = solved(near_goal, short, SEEDS).steps
    simulation.reset(SEEDS)
    starts = simulation.state.episodes.ego_s_m.copy()
    speeds = simulation.state.episodes.ego_speed_mps.copy()
    traffic = film(simulation, SEEDS)
    world, settings = simulation.world, simulation.settings
    rules = Rules(settings.step_s, settings.decision_steps, settings.limit_steps, world.ego.goal_m)
    for b in np.flatnonzero(steps != IMPOSSIBLE):
        one = traffic._replace(driving=traffic.driving[b], path=traffic.path[b], s_m=traffic.s_m[b])
        reachable = speeds_from(settings.ego, rules, speeds[b])
        bounds = lower_bounds(
            world.ego, world.paths, rules, reachable, one, starts[b], settings.limit_steps
        )
        assert bounds.least[0, 0, 0] <= steps[b]


def test_on_an_empty_road_it_drives_fast_all_the_way(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    scenario = replace(
        empty_road, ego=EgoStart(distance_m=Interval(20.0, 20.0), speed_mps=Interval(2.0, 2.0))
    )
    found = solved(crossing_model, scenario, np.array([0]))
    # From 2 to 5 m/s in 2 s over 7 m; the other 39 of 46 m to the goal at 120 take 7.8 s.
    assert found.steps[0] == math.ceil((2.0 + 7.8) / 0.1 - 1e-9)


def test_the_simulation_drives_the_optimum_in_exactly_its_time(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    simulation = Simulation(crossing_model, busy, 60)
    seeds = np.arange(60)
    found = optima(simulation, seeds)
    driven = drive(simulation, ClairvoyantPolicy(found.actions), seeds)
    assert (driven.outcome == Outcome.SUCCESS).all()
    np.testing.assert_allclose(driven.statistics.duration_s, found.steps * 0.1, atol=1e-9)


def test_what_the_ego_perceives_or_what_comes_late_is_not_searched_again(
    crossing_model: IntersectionModel, busy: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    known, seeds = KnownOptima(), np.arange(12)
    first = optima(Simulation(crossing_model, busy, 12), seeds, known=known)
    ended = replace(busy, traffic=replace(busy.traffic, respawn=not busy.traffic.respawn))
    noisy = replace(busy, sensor=replace(busy.sensor, range_m=30.0, velocity_noise_mps=1.0))
    expected = [optima(Simulation(crossing_model, each, 12), seeds) for each in (ended, noisy)]

    def refuse(*_: object) -> None:
        raise AssertionError("this episode was searched before")

    monkeypatch.setattr(clairvoyant, "fastest_way", refuse)
    for scenario, fresh in zip((ended, noisy), expected, strict=True):
        again = optima(Simulation(crossing_model, scenario, 12), seeds, known=known)
        for one, other in zip(again, fresh, strict=True):
            np.testing.assert_array_equal(one, other)
    assert (first.steps > 0).all()


def test_other_traffic_from_the_same_start_is_searched_anew(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    known, seeds = KnownOptima(), np.arange(12)
    slow = replace(busy, traffic=replace(busy.traffic, desired_speed_mps=Interval(2.0, 3.0)))
    optima(Simulation(crossing_model, busy, 12), seeds, known=known)
    after = optima(Simulation(crossing_model, slow, 12), seeds, known=known)
    np.testing.assert_array_equal(
        after.steps, optima(Simulation(crossing_model, slow, 12), seeds).steps
    )


def test_without_room_for_a_proof_it_says_what_is_known(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    simulation = Simulation(crossing_model, busy, 8)
    seeds = np.arange(8)
    best = optima(simulation, seeds)
    hasty = optima(simulation, seeds, most_states=150)
    assert best.proven.all()
    assert not hasty.proven.all()
    np.testing.assert_array_equal(hasty.steps[hasty.proven], best.steps[hasty.proven])
    found = hasty.steps != IMPOSSIBLE
    assert (hasty.steps[found] >= best.steps[found]).all()
    assert (hasty.at_least <= best.steps).all()


def test_speeds_are_few_and_closed_under_the_actions() -> None:
    speeds = speeds_from(EgoDrive(1.5, 3.5, 1.0, 5.0), Rules(0.1, 5, 600, 100.0), 5.0)
    # From 5 m/s all speeds are whole quarters, the common divisor of 0.75 and 1.75.
    np.testing.assert_allclose(np.sort(speeds.mps), np.arange(21) / 4.0, atol=1e-9)
    assert speeds.after.max() < len(speeds.mps)
    # Stop from 5 m/s for 0.5 s: 5 x 0.5 - 3.5 / 2 x 0.25.
    assert speeds.way_m[0, 0, -1] == pytest.approx(2.0625)


def test_refuses_merging_lanes_because_followers_react(
    merging_model: IntersectionModel, base: Scenario
) -> None:
    with pytest.raises(ScenarioError, match="merging lane 20"):
        solved(merging_model, base, np.array([0]))


def test_refuses_traffic_that_yields(crossing_model: IntersectionModel, base: Scenario) -> None:
    polite = replace(base, traffic=replace(base.traffic, yielding_share=0.1))
    with pytest.raises(ScenarioError, match="yield"):
        solved(crossing_model, polite, np.array([0]))
