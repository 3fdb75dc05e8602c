# SPDX-License-Identifier: Apache-2.0
import itertools
from dataclasses import replace

import numpy as np
import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.situation.config import INSTANTANEOUS, TRACKED
from sim_bridge.environment.episodes import DrivenEpisodes, drive
from sim_bridge.environment.interface import Outcome
from sim_bridge.evaluation.clairvoyant import optima
from sim_bridge.evaluation.soundness.beam import Beam, BeamConfig
from sim_bridge.scenarios.fields import EgoStart, Interval, Obstacles, Timing
from sim_bridge.scenarios.loading import Scenario
from sim_bridge.simulation.simulation import Simulation

DECISIONS = 8
SEEDS = np.arange(8)
ALL = BeamConfig(width=3**DECISIONS // 6, cell_m=1e-6, cell_mps=1e-6)


@pytest.fixture(scope="module")
def short(base: Scenario) -> Scenario:
    """Episodes of 4 s that begin just before traffic, which a wall hides on either side."""
    return replace(
        base,
        ego=EgoStart(distance_m=Interval(0.5, 2.0), speed_mps=Interval(3.0, 5.0)),
        traffic=replace(
            base.traffic, vehicles=Interval(2, 4), start_distance_m=Interval(5.0, 60.0)
        ),
        obstacles=replace(base.obstacles, gap_ego_m=Interval(2.0, 4.0)),
        timing=Timing(limit_s=0.5 * DECISIONS),
    )


def tried_out(
    model: IntersectionModel, scenario: Scenario, assumptions: SafetyAssumptions, seed: int
) -> int:
    """Inner steps of the best of all sequences of actions the Guard calls sound; 0 for none."""
    sequences = np.array(list(itertools.product(range(3), repeat=DECISIONS)))
    simulation = Simulation(model, scenario, len(sequences))
    simulation.reset(np.full(len(sequences), seed))
    guard, sound = Guard(assumptions), np.ones(len(sequences), dtype=np.bool_)
    restart = np.ones(len(sequences), dtype=np.bool_)
    for step in range(DECISIONS):
        running = simulation.state.episodes.running.copy()
        check = guard.look(simulation.situations(), restart)
        action = sequences[:, step]
        allowed = guard.sound(check)[np.arange(len(action)), action]
        sound &= allowed | ~running
        guard.decided(check, action)
        simulation.step(action)
        restart[:] = False
    reached = simulation.state.episodes.reached_goal & sound
    return int(simulation.state.episodes.tick[reached].min()) if reached.any() else 0


def searched(
    model: IntersectionModel,
    scenario: Scenario,
    assumptions: SafetyAssumptions | None,
    config: BeamConfig,
    seeds: np.ndarray = SEEDS,
    batch: int = 2048,
    memory: str = INSTANTANEOUS,
) -> DrivenEpisodes:
    narrow, wide = (Simulation(model, scenario, rows, memory=memory) for rows in (batch, 3 * batch))
    return Beam(narrow, wide, assumptions, config).search(seeds)


def steps(driven: DrivenEpisodes) -> np.ndarray:
    inner = np.round(driven.statistics.duration_s / 0.1).astype(np.int64)
    return np.where(driven.outcome == Outcome.SUCCESS, inner, 0)


@pytest.mark.parametrize("assumptions", [SafetyAssumptions(), SafetyAssumptions(safe_gap_s=1.0)])
def test_finds_what_trying_out_every_sound_sequence_finds(
    crossing_model: IntersectionModel, short: Scenario, assumptions: SafetyAssumptions
) -> None:
    near_goal = replace(crossing_model, goal_m=107.0)
    expected = [tried_out(near_goal, short, assumptions, seed) for seed in SEEDS]
    found = steps(searched(near_goal, short, assumptions, ALL))
    np.testing.assert_array_equal(found, expected)
    # The cases hold what makes them worth comparing.
    assert 0 in expected
    assert len(set(expected)) > 2


def test_where_lanes_merge_it_finds_the_same_too(
    merging_model: IntersectionModel, short: Scenario
) -> None:
    near_goal = replace(merging_model, goal_m=107.0)
    expected = [tried_out(near_goal, short, SafetyAssumptions(), seed) for seed in SEEDS]
    found = steps(searched(near_goal, short, SafetyAssumptions(), ALL))
    np.testing.assert_array_equal(found, expected)
    assert len(set(expected)) > 2


def test_without_a_check_it_finds_the_clairvoyant_s_optimum(
    crossing_model: IntersectionModel, short: Scenario
) -> None:
    near_goal = replace(crossing_model, goal_m=107.0)
    expected = optima(Simulation(near_goal, short, len(SEEDS)), SEEDS).steps
    found = steps(searched(near_goal, short, None, ALL))
    np.testing.assert_array_equal(found, np.maximum(expected, 0))


@pytest.mark.parametrize("memory", [INSTANTANEOUS, TRACKED])
def test_a_narrow_beam_is_never_slower_than_the_fastest_sound_action(
    crossing_model: IntersectionModel, busy: Scenario, memory: str
) -> None:
    seeds = np.arange(20)
    simulation = Simulation(crossing_model, busy, 20, memory=memory)
    driven = drive(simulation, FastestSoundPolicy(), seeds)
    narrow = searched(
        crossing_model, busy, SafetyAssumptions(), BeamConfig(width=8), seeds, 64, memory
    )
    assert (narrow.outcome[driven.outcome == Outcome.SUCCESS] == Outcome.SUCCESS).all()
    assert (steps(narrow) <= steps(driven))[driven.outcome == Outcome.SUCCESS].all()


def test_an_episode_is_the_same_in_any_company(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    config = BeamConfig(width=16)
    together = searched(crossing_model, busy, SafetyAssumptions(), config, np.arange(9), 64)
    alone = searched(crossing_model, busy, SafetyAssumptions(), config, np.array([7]), 16)
    assert together.outcome[7] == alone.outcome[0]
    for one, other in zip(together.statistics, alone.statistics, strict=True):
        np.testing.assert_array_equal(one[7], other[0])


def test_on_an_empty_road_the_check_costs_nothing(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    scenario = replace(
        empty_road,
        ego=EgoStart(distance_m=Interval(20.0, 20.0), speed_mps=Interval(2.0, 2.0)),
        obstacles=Obstacles(per_side=0),
    )
    found = searched(
        crossing_model, scenario, SafetyAssumptions(), BeamConfig(width=8), np.array([0]), 8
    )
    # From 2 to 5 m/s in 2 s over 7 m; the other 39 of 46 m to the goal at 120 take 7.8 s.
    assert found.statistics.duration_s[0] == pytest.approx(9.8)
    assert found.statistics.action_counts[0].tolist() == [0, 0, 20]


def test_batches_must_have_room(crossing_model: IntersectionModel, base: Scenario) -> None:
    with pytest.raises(ConfigurationError, match="do not fit a width of 8"):
        searched(crossing_model, base, None, BeamConfig(width=8), SEEDS, batch=4)
    with pytest.raises(ConfigurationError, match=r"BeamConfig\.width is 0"):
        BeamConfig(width=0)
