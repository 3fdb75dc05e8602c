# SPDX-License-Identifier: Apache-2.0
"""Worlds that do not keep what the planner takes for granted do exactly what they say."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.batch import BatchEnvironment
from sim_bridge.environment.place import load_place
from sim_bridge.environment.rewards import reward_named
from sim_bridge.scenarios.fields import Interval, Scenario
from sim_bridge.scenarios.loading import load_scenario
from sim_bridge.simulation.simulation import Simulation

WithVehicles = Callable[..., Scenario]
STOP, SLOW, FAST = 0, 1, 2


def with_ego(scenario: Scenario, start_mps: float, **fields: float) -> Scenario:
    """The scenario whose ego starts 50 m before the line, and other fields of it."""
    start, speed = Interval(50.0, 50.0), Interval(start_mps, start_mps)
    ego = replace(scenario.ego, distance_m=start, speed_mps=speed, **fields)
    return replace(scenario, ego=ego)


def speeds(simulation: Simulation, actions: list[int]) -> list[float]:
    """The ego's speed after each inner step under one action each."""
    return [
        (simulation.inner_step([action]), float(simulation.state.episodes.ego_speed_mps[0]))[1]
        for action in actions
    ]


def test_weak_brakes_need_one_over_their_factor_of_the_way(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    way = []
    for factor in (1.0, 0.8):
        simulation = Simulation(crossing_model, with_ego(empty_road, 5.0, braking_factor=factor), 1)
        simulation.reset([1])
        begin = simulation.state.episodes.ego_s_m[0]
        for _ in range(10):
            simulation.step([STOP])
        assert simulation.state.episodes.ego_speed_mps[0] == 0.0
        way.append(simulation.state.episodes.ego_s_m[0] - begin)
    # 5^2 / (2 * 3.5), and with 2.8 m/s^2.
    assert way == pytest.approx([25.0 / 7.0, 25.0 / 5.6])


def test_weak_brakes_accelerate_as_ever(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    simulation = Simulation(crossing_model, with_ego(empty_road, 2.0, braking_factor=0.8), 1)
    simulation.reset([1])
    assert speeds(simulation, [FAST] * 2) == pytest.approx([2.15, 2.3])


def test_a_decision_takes_effect_as_many_inner_steps_later_as_the_delay_has(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    delayed = with_ego(empty_road, 3.0, actuation_delay_s=0.2)
    simulation = Simulation(crossing_model, delayed, 1)
    simulation.reset([1])
    # The ego keeps its first speed until the first decision takes effect; that to stop comes
    # after three inner steps and works from the sixth on.
    found = speeds(simulation, [FAST] * 3 + [STOP] * 5)
    assert found == pytest.approx([3.0, 3.0, 3.15, 3.3, 3.45, 3.1, 2.75, 2.4])


def test_a_delay_of_a_decision_period_carries_out_the_decision_before(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    delayed = Simulation(crossing_model, with_ego(empty_road, 3.0, actuation_delay_s=0.5), 1)
    prompt = Simulation(crossing_model, with_ego(empty_road, 3.0), 1)
    delayed.reset([1])
    prompt.reset([1])
    chosen = [FAST, STOP, SLOW, FAST, FAST, STOP]
    delayed.step([chosen[0]])
    assert delayed.state.episodes.ego_speed_mps[0] == 3.0
    for following, action in zip(chosen[1:], chosen, strict=False):
        delayed.step([following])
        prompt.step([action])
        assert delayed.state.episodes.ego_speed_mps[0] == prompt.state.episodes.ego_speed_mps[0]
    # Counted is what was decided.
    assert delayed.statistics().action_counts[0].tolist() == [2, 1, 3]


def test_a_new_episode_knows_nothing_of_the_decisions_before(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    simulation = Simulation(crossing_model, with_ego(empty_road, 3.0, actuation_delay_s=0.5), 2)
    simulation.reset([1, 2])
    simulation.step([STOP, STOP])
    simulation.reset([1, 2], mask=[True, False])
    simulation.step([FAST, FAST])
    assert simulation.state.episodes.ego_speed_mps.tolist() == [3.0, pytest.approx(1.25)]


def test_others_drive_over_the_limit_by_the_factor(
    crossing_model: IntersectionModel, with_vehicles: WithVehicles
) -> None:
    # The drawn 9 m/s are cut to the limit of 7 and raised to 8.4; the drawn 4 m/s to 4.8.
    for drawn, expected in ((9.0, 8.4), (4.0, 4.8)):
        desired = Interval(drawn, drawn)
        scenario = with_vehicles(
            load_scenario("base"), 6, overspeed_factor=1.2, desired_speed_mps=desired
        )
        simulation = Simulation(crossing_model, scenario, 30)
        simulation.reset(np.arange(30))
        for _ in range(30):
            vehicles = simulation.state.vehicles
            assert vehicles.desired_speed_mps == pytest.approx(expected)
            assert vehicles.speed_mps.max() <= expected + 1e-9
            simulation.step([STOP] * 30)
        assert vehicles.speed_mps.max() > expected - 0.05


def test_in_others_over_the_limit_everyone_wants_20_percent_more_on_every_map() -> None:
    for name in ("four_way", "roundabout"):
        simulation = load_place(name).simulation(load_scenario("others_over_the_limit"), 20)
        simulation.reset(np.arange(20))
        vehicles = simulation.state.vehicles
        limit = simulation.world.paths.limit_mps[vehicles.path]
        ratio = (vehicles.desired_speed_mps / limit)[vehicles.driving]
        assert ratio == pytest.approx(np.full(len(ratio), 1.2))


@pytest.mark.parametrize(
    ("name", "group", "field", "value"),
    [
        ("weak_brakes", "ego", "braking_factor", 0.8),
        ("delay_200ms", "ego", "actuation_delay_s", 0.2),
        ("delay_500ms", "ego", "actuation_delay_s", 0.5),
        ("missed_detections", "sensor", "missed_share", 0.05),
        ("phantom_detections", "sensor", "phantom_share", 0.05),
        ("velocity_bias", "sensor", "velocity_bias_mps", -1.0),
        ("braking_traffic", "traffic", "brakes_for_ego_after_s", 1.0),
    ],
)
def test_a_violated_assumption_is_all_that_its_scenario_changes(
    name: str, group: str, field: str, value: float
) -> None:
    base, scenario = load_scenario("base"), load_scenario(name)
    assert getattr(getattr(scenario, group), field) == value
    changed = replace(getattr(base, group), **{field: value})
    named = {"name": name, "description": scenario.description}
    assert replace(base, **{group: changed}, **named) == scenario


WORLDS = {
    "ego": {"braking_factor": 0.8, "actuation_delay_s": 0.2},
    "sensor": {"missed_share": 0.3, "velocity_bias_mps": -1.0, "phantom_share": 0.5},
    "traffic": {"overspeed_factor": 1.2, "brakes_for_ego_after_s": 1.0},
}


def violated_at_once(scenario: Scenario) -> Scenario:
    """The scenario with every assumption violated."""
    groups = {name: replace(getattr(scenario, name), **new) for name, new in WORLDS.items()}
    return replace(scenario, **groups)


def test_a_seed_is_the_same_violated_episode_alone_and_among_others(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    scenario = violated_at_once(busy)
    together, alone = (Simulation(crossing_model, scenario, count) for count in (7, 1))
    together.reset(np.arange(7))
    alone.reset([4])
    for step in range(40):
        one, many = alone.situations(), together.situations()
        for name in one._fields:
            mask = one.vehicle_mask if name.startswith("vehicle") else ...
            found, expected = getattr(many, name)[[4]], getattr(one, name)
            assert np.array_equal(found[mask], expected[mask]), name
        assert alone.ego_poses()[0].tolist() == together.ego_poses()[4].tolist()
        action = (step * step) % 3
        alone.step([action])
        together.step([(action + k - 4) % 3 for k in range(7)])


def test_a_checkpoint_goes_on_with_the_same_decisions_under_way() -> None:
    scenario = violated_at_once(load_scenario("base"))

    def environment() -> BatchEnvironment:
        simulation = load_place("four_way").simulation(scenario, 16)
        reward, encoder = reward_named("risk"), StateEncoder()
        return BatchEnvironment(simulation, encoder, reward, RiskConfig(), 3)

    first, second = environment(), environment()
    first.reset()
    actions = [np.full(16, k % 3, dtype=np.int64) for k in range(30)]
    for chosen in actions[:15]:
        first.step(chosen)
    second.load_state_dict(first.state_dict())
    for chosen in actions[15:]:
        assert np.array_equal(first.step(chosen).states, second.step(chosen).states)
