# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_bridge.evaluation.statistics import Z_95, mean_interval, ratio_interval, wilson


def test_wilson_at_hand_computed_points() -> None:
    # z2 = 3.841459; 8 of 10: center (0.8 + 0.192073) / 1.384146, and half the root's width.
    assert wilson(8, 10) == pytest.approx((0.8, 0.490162, 0.943318), abs=1e-6)
    # Nothing in n: from 0 to z2 / (n + z2).
    z2 = Z_95 * Z_95
    assert wilson(0, 3000) == pytest.approx((0.0, 0.0, z2 / (3000 + z2)))
    assert wilson(3000, 3000) == pytest.approx((1.0, 3000 / (3000 + z2), 1.0))


@given(st.integers(1, 5000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_is_a_share_around_the_rate_and_mirrors(counts: tuple[int, int]) -> None:
    count, of = counts
    rate, low, high = wilson(count, of)
    assert 0.0 <= low <= rate <= high <= 1.0
    mirrored = wilson(of - count, of)
    assert (1.0 - high, 1.0 - low) == pytest.approx(mirrored[1:], abs=1e-12)


@pytest.mark.parametrize(("count", "of"), [(0, 0), (-1, 5), (6, 5)])
def test_wilson_refuses_what_is_no_share(count: int, of: int) -> None:
    with pytest.raises(ValueError, match="no share"):
        wilson(count, of)


def test_mean_interval_at_a_hand_computed_point() -> None:
    # 1, 2, 3, 4: variance 5/3, standard error sqrt(5/12).
    half = Z_95 * np.sqrt(5.0 / 12.0)
    assert mean_interval([1.0, 2.0, 3.0, 4.0]) == pytest.approx((2.5, 2.5 - half, 2.5 + half))
    assert mean_interval([7.0]) == (7.0, 7.0, 7.0)
    assert mean_interval([]) is None


def test_ratio_interval_at_a_hand_computed_point() -> None:
    # 1/4 and 2/2 together 3/6; residuals -1 and 1, mean whole 3: error sqrt(2 / 2) / 3.
    assert ratio_interval([1, 2], [4, 2]) == pytest.approx(
        (0.5, 0.5 - Z_95 / 3.0, 0.5 + Z_95 / 3.0)
    )
    assert ratio_interval([0], [0]) is None
    assert ratio_interval([1], [4]) == (0.25, 0.25, 0.25)


def test_intervals_cover_the_truth_about_as_often_as_they_say() -> None:
    draw = np.random.default_rng(0)
    true_rate, trials, repetitions = 0.1, 400, 2000
    counts = draw.binomial(trials, true_rate, repetitions)
    shares = [wilson(int(count), trials) for count in counts]
    covered = np.mean([low <= true_rate <= high for _, low, high in shares])
    assert 0.93 < covered < 0.97
    lengths = draw.integers(1, 20, (repetitions, 200))
    parts = draw.binomial(lengths, 0.3)
    ratios = [ratio_interval(p, n) for p, n in zip(parts, lengths, strict=True)]
    covered = np.mean([r is not None and r.low <= 0.3 <= r.high for r in ratios])
    assert 0.93 < covered < 0.97
