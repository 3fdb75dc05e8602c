# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_bridge.simulation.randomness import (
    random_between,
    random_bits,
    random_index,
    random_normal,
    random_share,
)

WORD = (1 << 64) - 1
seeds = st.integers(0, WORD).map(np.uint64)
indices = st.integers(0, 1 << 40)


def mix(bits: int) -> int:
    """SplitMix64's output function in Python's own integers."""
    bits = ((bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9) & WORD
    bits = ((bits ^ (bits >> 27)) * 0x94D049BB133111EB) & WORD
    return bits ^ (bits >> 31)


def reference(seed: int, stream: int, index: int) -> int:
    golden = 0x9E3779B97F4A7C15
    key = mix((seed + golden) & WORD)
    key = mix((key + (stream + 1) * golden) & WORD)
    return mix((key + (index + 1) * golden) & WORD)


def test_the_mixing_is_that_of_splitmix64():
    # The first output of SplitMix64 from state 0, as published with the generator.
    assert mix(0x9E3779B97F4A7C15) == 0xE220A8397B1DCDAF


@given(seeds, st.integers(0, 100), indices)
def test_bits_are_those_of_the_reference(seed: int, stream: int, index: int):
    assert int(random_bits(seed, stream, index)) == reference(int(seed), stream, index)


@given(seeds, indices)
def test_shares_lie_in_zero_to_one_and_come_from_the_upper_53_bits(seed: int, index: int):
    share = random_share(seed, 3, index)
    assert 0.0 <= share < 1.0
    assert share == (reference(int(seed), 3, index) >> 11) / 2**53


@given(seeds, indices, st.integers(1, 1000))
def test_an_index_is_one_of_its_count(seed: int, index: int, count: int):
    assert 0 <= random_index(seed, 1, index, count) < count


def test_numbers_of_neighbouring_seeds_streams_and_indices_are_unrelated():
    count = 4000
    for draws in (
        [random_share(np.uint64(k), 0, 0) for k in range(count)],
        [random_share(np.uint64(7), k, 0) for k in range(count)],
        [random_share(np.uint64(7), 0, k) for k in range(count)],
    ):
        # Standard errors: 1 / sqrt(12 n) = 0.0046 of a mean, 1 / sqrt(n) = 0.016 of a correlation.
        assert np.mean(draws) == pytest.approx(0.5, abs=0.02)
        assert np.var(draws) == pytest.approx(1.0 / 12.0, abs=0.006)
        assert abs(np.corrcoef(draws[:-1], draws[1:])[0, 1]) < 0.07


def test_normal_numbers_have_mean_zero_and_variance_one():
    draws = np.array([random_normal(np.uint64(5), 2, k) for k in range(8000)])
    assert draws.mean() == pytest.approx(0.0, abs=0.05)
    assert draws.var() == pytest.approx(1.0, abs=0.08)
    assert (np.abs(draws) < 1.96).mean() == pytest.approx(0.95, abs=0.012)


def test_numbers_between_two_bounds_fill_their_interval():
    draws = [random_between(np.uint64(1), 0, k, 20.0, 50.0) for k in range(1000)]
    assert 20.0 <= min(draws) < 20.3
    assert 49.7 < max(draws) < 50.0
