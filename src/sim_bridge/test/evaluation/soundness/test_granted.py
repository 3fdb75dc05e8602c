# SPDX-License-Identifier: Apache-2.0
"""A check that is told what its world does keeps its promise there, and still gets through."""

import numpy as np
import pytest

from risk_dqn_planner.policies.base import Policy
from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy
from risk_dqn_planner.policies.look_ahead import LookAheadPolicy
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from sim_bridge.environment.episodes import drive
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.place import load_place
from sim_bridge.environment.seeds import VALIDATION_SEEDS, fixed_seeds
from sim_bridge.evaluation.cells import RESPAWNING, Cell
from sim_bridge.evaluation.soundness.cells import granting_assumptions

EPISODES = 200


def outcomes(policy: Policy, scenario: str) -> dict[Outcome, int]:
    cell = Cell(scenario, RESPAWNING, sensor_forward_m=0.0)
    simulation = load_place("four_way").simulation(cell.load(), EPISODES)
    driven = drive(simulation, policy, fixed_seeds(VALIDATION_SEEDS, EPISODES))
    counts = np.bincount(driven.outcome, minlength=len(Outcome))
    return {outcome: int(counts[outcome]) for outcome in Outcome}


def granted(scenario: str) -> SafetyAssumptions:
    return granting_assumptions(Cell(scenario, RESPAWNING, sensor_forward_m=0.0))


@pytest.mark.parametrize("policy", [FastestSoundPolicy, LookAheadPolicy])
@pytest.mark.parametrize("scenario", ["delay_200ms", "delay_500ms", "weak_brakes"])
def test_who_is_told_does_not_collide_and_gets_through(
    policy: type[FastestSoundPolicy] | type[LookAheadPolicy], scenario: str
) -> None:
    found = outcomes(policy(granted(scenario)), scenario)
    assert found[Outcome.COLLISION] == 0
    assert found[Outcome.SUCCESS] >= 0.98 * EPISODES


@pytest.mark.parametrize("scenario", ["delay_200ms", "delay_500ms", "weak_brakes"])
def test_who_is_not_told_collides(scenario: str) -> None:
    assert outcomes(FastestSoundPolicy(), scenario)[Outcome.COLLISION] > 0.1 * EPISODES


def test_an_ego_told_of_more_than_it_does_does_not_collide_either() -> None:
    ranges = SafetyAssumptions(
        actuation_delay_s=0.4,
        actuation_jitter_s=0.4,
        ego_acceleration_factor=1.3,
        ego=granted("weak_brakes").ego,
        ego_braking_factor=1.25,
    )
    for scenario in ("delay_200ms", "weak_brakes", "base"):
        assert outcomes(FastestSoundPolicy(ranges), scenario)[Outcome.COLLISION] == 0
