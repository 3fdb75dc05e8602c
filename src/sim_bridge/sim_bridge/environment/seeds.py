# SPDX-License-Identifier: Apache-2.0
"""Which episode seeds belong to whom: results are reported on seeds no training ever saw.

A seed names one episode of a scenario. The ranges are disjoint, and small numbers, which
people type, are test episodes.
"""

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.simulation.randomness import random_index

Seeds = NDArray[np.int64]

TEST_SEEDS = range(1_000_000_000)
VALIDATION_SEEDS = range(1_000_000_000, 2_000_000_000)
TRAINING_SEEDS = range(2_000_000_000, 4_000_000_000)


@kernel
def _draw(run_seed: int, first: int, episode: Seeds, start: int, count: int, seeds: Seeds) -> None:
    for k in range(episode.shape[0]):
        seeds[k] = start + random_index(np.uint64(run_seed), np.int64(first + k), episode[k], count)


def training_seeds(run_seed: int, episode: Seeds, first: int = 0) -> Seeds:
    """Return the next episode seed (B,) of each environment of a training run.

    episode (B,): how many episodes the environment has begun. first: number of the first one of
    these environments among all of the run. The seed depends on (run_seed,
    environment, episode) alone, so it does not matter in which order episodes end.
    """
    seeds = np.empty_like(episode)
    _draw(run_seed, first, episode, TRAINING_SEEDS.start, len(TRAINING_SEEDS), seeds)
    return seeds


def fixed_seeds(purpose: range, count: int) -> Seeds:
    """Return the first `count` seeds of a range: the same episodes for everyone.

    Raises:
        ConfigurationError: the range holds fewer.
    """
    if not 0 < count <= len(purpose):
        raise ConfigurationError(f"{count} episodes asked for, expected 1 to {len(purpose)}")
    return np.arange(purpose.start, purpose.start + count, dtype=np.int64)
