# SPDX-License-Identifier: Apache-2.0
from itertools import combinations

import numpy as np
import pytest

from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.environment.seeds import (
    TEST_SEEDS,
    TRAINING_SEEDS,
    VALIDATION_SEEDS,
    fixed_seeds,
    training_seeds,
)


def test_no_two_purposes_share_a_seed() -> None:
    for first, second in combinations((TEST_SEEDS, VALIDATION_SEEDS, TRAINING_SEEDS), 2):
        assert first.stop <= second.start or second.stop <= first.start


def test_training_draws_only_from_its_own_range() -> None:
    seeds = np.concatenate([training_seeds(3, np.full(64, episode)) for episode in range(100)])
    assert seeds.min() >= TRAINING_SEEDS.start
    assert seeds.max() < TRAINING_SEEDS.stop
    assert len(set(seeds.tolist())) == len(seeds)


def test_an_environment_keeps_its_seeds_in_a_larger_batch_and_in_any_order() -> None:
    alone = training_seeds(7, np.array([5, 2, 9]))
    together = training_seeds(7, np.array([5, 2, 9, 4]))
    np.testing.assert_array_equal(together[:3], alone)
    np.testing.assert_array_equal(training_seeds(7, np.array([5, 0, 0]))[0], alone[0])


def test_runs_with_other_seeds_see_other_episodes() -> None:
    assert not np.isin(training_seeds(0, np.arange(50)), training_seeds(1, np.arange(50))).any()


def test_fixed_seeds_are_the_first_of_their_range() -> None:
    assert fixed_seeds(VALIDATION_SEEDS, 3).tolist() == [
        1_000_000_000,
        1_000_000_001,
        1_000_000_002,
    ]
    with pytest.raises(ConfigurationError, match="0 episodes asked for"):
        fixed_seeds(TEST_SEEDS, 0)
