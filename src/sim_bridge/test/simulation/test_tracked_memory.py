# SPDX-License-Identifier: Apache-2.0
"""The memory of simulated egos: no vehicle may ever be where it says that none can be."""

import copy
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.config import SituationConfig, TrackingConfig
from risk_dqn_planner.situation.inputs import EgoPose, ObjectArrays
from risk_dqn_planner.situation.situations import Booleans, Floats, Situations
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.batch import BatchEnvironment
from sim_bridge.environment.place import load_place
from sim_bridge.environment.rewards import reward_named
from sim_bridge.perception.tracking import Tracker
from sim_bridge.scenarios.fields import Scenario
from sim_bridge.scenarios.loading import load_scenario
from sim_bridge.simulation.simulation import Simulation

MAPS = ("four_way", "t_junction", "multi_lane", "roundabout")
BATCH, DECISIONS = 512, 45
# Finer details of curved lanes than the sight lines have are taken for hidden [m].
GRAZING_M = 0.1


def scenarios() -> Iterator[Scenario]:
    for name in ("base", "dense_traffic", "severe_occlusion", "close_small_obstacle"):
        yield load_scenario(name)
    short = load_scenario("short_sensor_range")
    yield short
    # Out of reach of every lane when the episode begins, and some way into it.
    yield replace(short, sensor=replace(short.sensor, range_m=20.0, forward_offset_m=1.0))


def drive(simulation: Simulation, decisions: int) -> Iterator[Situations]:
    """Let all egos act at random, each episode followed by the next; yield what they see."""
    batch = simulation.batch
    random = np.random.default_rng(7)
    seeds = np.arange(batch)
    simulation.reset(seeds)
    actions = random.integers(0, 3, batch)
    situations = simulation.situations()
    for _ in range(decisions):
        yield situations
        change = random.random(batch) < 0.2
        actions = np.where(change, random.integers(0, 3, batch), actions)
        result = simulation.step(actions)
        ended = result.terminated | result.truncated
        seeds = np.where(ended, seeds + batch, seeds)
        simulation.reset(seeds, ended)
        simulation.situations(out=situations)


def tracker_of(simulation: Simulation) -> Tracker:
    assert simulation.tracker is not None
    return simulation.tracker


def hidden_vehicles(simulation: Simulation) -> tuple[Floats, Booleans, Booleans]:
    """Return of all vehicles (B, N): distance, whether driving, whether hidden where one looks."""
    vehicles, lines = simulation.state.vehicles, tracker_of(simulation).lines
    poses = simulation.vehicle_poses()
    distance = simulation.world.paths.zone_m[vehicles.path] - vehicles.s_m
    looked_at = distance >= lines.exit_m[vehicles.path]
    looked_at &= distance <= lines.end_m[vehicles.path]
    driving = poses.mask & simulation.state.episodes.running[:, None]
    return distance, driving, driving & poses.hidden & looked_at


def in_set(simulation: Simulation, distance: Floats) -> Booleans:
    """Whether each vehicle (B, N) is in the set of its own path."""
    memory, path = tracker_of(simulation).space, simulation.state.vehicles.path
    rows = np.arange(simulation.batch)[:, None] * len(tracker_of(simulation).lines.lane) + path
    near, far = memory.near_m[rows], memory.far_m[rows]
    there = np.arange(near.shape[-1]) < memory.held[rows][..., None]
    at = distance[..., None]
    result: Booleans = (there & (near <= at) & (at <= far)).any(axis=-1)
    return result


@pytest.mark.parametrize("map_name", MAPS)
def test_every_hidden_vehicle_is_where_the_memory_says_one_may_be(map_name: str) -> None:
    place = load_place(map_name)
    steps = hidden_steps = out_of_reach = 0
    for scenario in scenarios():
        simulation = place.simulation(scenario, BATCH, memory="tracked")
        for situations in drive(simulation, DECISIONS):
            distance, driving, hidden = hidden_vehicles(simulation)
            inside = in_set(simulation, distance)
            assert (inside | ~hidden).all(), (scenario.name, np.argwhere(hidden & ~inside)[0])
            steps += int(driving.sum())
            hidden_steps += int(hidden.sum())
            blind = situations.lane_hidden_distance_m <= tracker_of(simulation).lines.exit_m.max()
            out_of_reach += int(blind.all(axis=1).sum())
    # Four maps: together over two million.
    assert steps > 500_000
    assert hidden_steps > 150_000
    assert out_of_reach > 1000


@pytest.mark.parametrize(
    "wrong", [{"speed_factor": 0.6}, {"min_speed_mps": 6.0}], ids=["too slow", "too fast"]
)
def test_wrong_assumptions_lose_vehicles(wrong: dict[str, float]) -> None:
    """So the test above would notice."""
    place = load_place("four_way")
    scenario = load_scenario("severe_occlusion")
    tracking = TrackingConfig(**wrong)
    simulation = place.simulation(scenario, 256, memory="tracked", tracking=tracking)
    lost = 0
    for _ in drive(simulation, DECISIONS):
        distance, _, hidden = hidden_vehicles(simulation)
        lost += int((hidden & ~in_set(simulation, distance)).sum())
    assert lost > 0


@pytest.mark.parametrize("map_name", MAPS)
def test_memory_never_makes_a_hidden_vehicle_nearer(map_name: str) -> None:
    place = load_place(map_name)
    for name in ("base", "close_small_obstacle", "short_sensor_range"):
        tracked = place.simulation(load_scenario(name), 64, memory="tracked")
        plain = place.simulation(load_scenario(name), 64)
        gains = []
        for with_memory, without in zip(drive(tracked, 30), drive(plain, 30), strict=True):
            gains.append(with_memory.lane_hidden_distance_m - without.lane_hidden_distance_m)
            for field in with_memory._fields:
                if field != "lane_hidden_distance_m" and not field.startswith("vehicle"):
                    assert np.array_equal(getattr(with_memory, field), getattr(without, field))
        gain = np.concatenate(gains)
        if map_name == "four_way":
            # Straight lanes have no finer details.
            assert gain.min() > -1e-4
        # On curved ones a line of sight that grazes an edge may be taken for hidden.
        assert (gain < -GRAZING_M).mean() < 0.05
        assert (gain < -1.0).mean() < 1e-3


def test_behind_a_small_obstacle_nobody_hides_for_long() -> None:
    place = load_place("four_way")

    def mean_gain(name: str) -> float:
        scenario = load_scenario(name)
        tracked = place.simulation(scenario, 256, memory="tracked")
        plain = place.simulation(scenario, 256)
        gains = [
            (a.lane_hidden_distance_m - b.lane_hidden_distance_m).mean()
            for a, b in zip(drive(tracked, 40), drive(plain, 40), strict=True)
        ]
        return float(np.mean(gains))

    assert mean_gain("close_small_obstacle") > 0.3
    assert mean_gain("severe_occlusion") < 0.05


def test_an_episode_is_remembered_alike_in_any_batch_and_after_any_reset(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    many = Simulation(crossing_model, busy, 6, memory="tracked")
    one = Simulation(crossing_model, busy, 1, memory="tracked")
    many.reset(np.arange(6))
    for k in range(5):
        many.situations()
        many.step([k % 3] * 6)
    # Only episode 4 begins anew, as seed 11; the others go on.
    before = tracker_of(many).space.near_m.copy()
    many.reset([11] * 6, np.arange(6) == 4)
    one.reset([11])
    assert np.array_equal(tracker_of(many).space.near_m, before)
    for k in range(20):
        found = many.situations().lane_hidden_distance_m[4]
        assert np.array_equal(found, one.situations().lane_hidden_distance_m[0])
        assert [i.tolist() for i in tracker_of(many).intervals(4)] == [
            i.tolist() for i in tracker_of(one).intervals()
        ]
        many.step([2 - k % 2] * 6)
        one.step([2 - k % 2])


def test_a_look_that_is_left_out_only_widens_the_set(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    often = Simulation(crossing_model, busy, 200, memory="tracked")
    seldom = Simulation(crossing_model, busy, 200, memory="tracked")
    for simulation in (often, seldom):
        simulation.reset(np.arange(200))
        simulation.situations()
    for _ in range(5):
        for k in range(3):
            often.step([2] * 200)
            seldom.step([2] * 200)
            found = often.situations().lane_hidden_distance_m
            if k == 2:
                assert (seldom.situations().lane_hidden_distance_m <= found + 1e-4).all()
        distance, _, hidden = hidden_vehicles(seldom)
        assert (in_set(seldom, distance) | ~hidden).all()


def test_a_second_look_at_the_same_time_changes_nothing(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    simulation = Simulation(crossing_model, busy, 20, memory="tracked")
    simulation.reset(np.arange(20))
    for _ in range(5):
        first = simulation.situations().lane_hidden_distance_m.copy()
        kept = copy.deepcopy(tracker_of(simulation).space)
        assert np.array_equal(simulation.situations().lane_hidden_distance_m, first)
        assert np.array_equal(tracker_of(simulation).space.held, kept.held)
        simulation.step([2] * 20)


@pytest.mark.parametrize("model_name", ["crossing_model", "merging_model"])
def test_the_vehicles_own_memory_agrees_with_the_simulated_one(
    request: pytest.FixtureRequest, model_name: str
) -> None:
    """By polygons and objects, as the situation node gets them, and by shadows and paths."""
    model = request.getfixturevalue(model_name)
    scenario = load_scenario("close_small_obstacle")
    for seed in range(4):
        simulation = Simulation(model, scenario, 1, memory="tracked")
        simulation.reset([seed])
        builder = SituationBuilder(model, SituationConfig(memory="tracked"))
        for step in range(25):
            expected = simulation.situations().lane_hidden_distance_m[0]
            poses, ego = simulation.vehicle_poses(), simulation.ego_poses()[0]
            seen = poses.mask[0] & ~poses.hidden[0]
            size = np.zeros(int(seen.sum()))
            objects = ObjectArrays(
                poses.id[0, seen],
                poses.x_m[0, seen],
                poses.y_m[0, seen],
                poses.heading_rad[0, seen],
                poses.speed_mps[0, seen],
                size,
                size,
            )
            built = builder.build(
                EgoPose(*ego), objects, simulation.visible_area(), time_s=0.5 * step
            )
            assert built.lane_hidden_distance_m[0] == pytest.approx(expected, abs=GRAZING_M)
            simulation.step([2 if step < 8 else step % 3])


def test_a_checkpoint_goes_on_with_the_same_memory() -> None:
    scenario = load_scenario("close_small_obstacle")

    def environment() -> BatchEnvironment:
        simulation = load_place("four_way").simulation(scenario, 32, memory="tracked")
        encoder = StateEncoder()
        return BatchEnvironment(simulation, encoder, reward_named("risk"), RiskConfig(), 3)

    first, second = environment(), environment()
    first.reset()
    actions = [np.full(32, k % 3, dtype=np.int64) for k in range(30)]
    for chosen in actions[:15]:
        first.step(chosen)
    second.load_state_dict(first.state_dict())
    for chosen in actions[15:]:
        one, other = first.step(chosen), second.step(chosen)
        assert np.array_equal(one.states, other.states)
        assert np.array_equal(one.reward, other.reward)
    for mine, yours in zip(
        tracker_of(first.simulation).space, tracker_of(second.simulation).space, strict=True
    ):
        assert np.array_equal(mine, yours)


def test_without_memory_there_is_none(crossing_model: IntersectionModel, busy: Scenario) -> None:
    simulation = Simulation(crossing_model, busy, 2)
    assert simulation.tracker is None
    assert simulation.hidden_space is None
    with pytest.raises(ConfigurationError, match="memory is 'elephant'"):
        Simulation(crossing_model, busy, 2, memory="elephant")
