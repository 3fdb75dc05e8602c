# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.batch import BatchEnvironment
from sim_bridge.environment.place import load_place
from sim_bridge.environment.rewards import reward_named
from sim_bridge.environment.side_by_side import SideBySide, shares_of
from sim_bridge.scenarios.loading import load_scenario


def environment(scenario: str, batch: int, first: int = 0) -> BatchEnvironment:
    simulation = load_place("four_way").simulation(load_scenario(scenario), batch)
    return BatchEnvironment(
        simulation, StateEncoder(), reward_named("risk"), RiskConfig(), 7, first
    )


def test_shares_are_as_even_as_can_be_and_lose_nothing() -> None:
    assert shares_of(64, 16) == [4] * 16
    assert shares_of(20, 16) == [2] * 4 + [1] * 12


def test_less_than_one_environment_each_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="3 environments or episodes for 4"):
        shares_of(3, 4)


def test_two_halves_of_one_scenario_are_the_whole() -> None:
    whole, halves = (
        environment("base", 6),
        SideBySide([environment("base", 2), environment("base", 4, 2)]),
    )
    np.testing.assert_array_equal(halves.reset(), whole.reset())
    random = np.random.default_rng(0)
    for _ in range(40):
        actions = random.integers(0, 3, 6)
        for one, other in zip(halves.step(actions), whole.step(actions), strict=True):
            np.testing.assert_array_equal(one, other)


def test_each_part_lives_in_its_own_scenario() -> None:
    parts = [environment("base", 3), environment("dense_traffic", 3, 3)]
    both = SideBySide(parts)
    both.reset()
    light, dense = (part.simulation.state.vehicles.driving.sum(axis=1) for part in parts)
    assert light.max() <= 6
    assert dense.max() > 6
