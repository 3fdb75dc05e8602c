# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.ros.soak.trend import Limits, theil_sen, thinned, trend

HOURS = np.linspace(0.0, 1.0, 200)


def noise(size_mb: float) -> np.ndarray:
    return np.random.default_rng(7).uniform(-size_mb, size_mb, len(HOURS))


def test_slope_of_three_points_is_the_median_of_their_three_slopes() -> None:
    # 0 to 1: 1, 1 to 3: 4, 0 to 3: 3
    assert theil_sen([0.0, 1.0, 3.0], [0.0, 1.0, 9.0]) == pytest.approx(3.0)


@given(
    slope=st.floats(-100.0, 100.0),
    offset=st.floats(-1000.0, 1000.0),
    places=st.lists(st.integers(0, 1000), min_size=2, max_size=30, unique=True),
)
def test_points_of_a_line_have_its_slope(slope: float, offset: float, places: list[int]) -> None:
    x = np.array(places, dtype=np.float64)
    assert theil_sen(x, slope * x + offset) == pytest.approx(slope, abs=1e-6)


def test_a_quarter_of_stray_samples_does_not_bend_a_slope() -> None:
    y = 3.0 * HOURS
    y[::4] += 500.0
    assert theil_sen(HOURS, y) == pytest.approx(3.0, abs=0.1)


def test_a_slope_at_one_place_is_refused() -> None:
    with pytest.raises(ValueError, match="different places"):
        theil_sen([1.0, 1.0], [2.0, 3.0])


def test_a_leak_of_ten_mb_an_hour_is_seen_through_noise() -> None:
    found = trend(HOURS, 300.0 + 10.0 * HOURS + noise(2.0), Limits().warm_up)
    assert found.growth == pytest.approx(10.0 * 0.8, abs=1.0)  # in the 0.8 h that count
    assert found.slope_per_h == pytest.approx(10.0, abs=1.0)
    assert found.growth > Limits().growth_mb


def test_noise_a_single_step_and_the_climb_of_a_warm_up_are_no_growth() -> None:
    climb = 60.0 * np.minimum(HOURS, 0.15) / 0.15
    step = np.where(HOURS > 0.9, 4.0, 0.0)
    found = trend(HOURS, 300.0 + climb + step + noise(1.0), Limits().warm_up)
    assert abs(found.growth) < 2.0
    assert found.ratio == pytest.approx(364.0 / 360.0, abs=0.003)


def test_growth_of_a_longer_run_is_that_of_one_hour() -> None:
    found = trend(10.0 * HOURS, 100.0 + 20.0 * HOURS, warm_up=0.0)  # 2 MB an hour for 10 h
    assert found.span_h == pytest.approx(10.0)
    assert found.growth == pytest.approx(2.0)


def test_begin_and_end_are_medians_of_the_first_and_last_tenth_after_the_warm_up() -> None:
    hours = np.arange(101.0)
    found = trend(hours, hours, warm_up=0.5)  # 50 to 100: five values at each end
    assert (found.begin, found.end) == (52.0, 98.0)


@given(count=st.integers(1, 5000), most=st.integers(2, 500))
def test_thinning_keeps_both_ends_and_the_order(count: int, most: int) -> None:
    kept = thinned(count, most)
    assert len(kept) == min(count, most)
    assert (kept[0], kept[-1]) == (0, count - 1)
    assert (np.diff(kept) > 0).all()


@pytest.mark.parametrize("wrong", [{"warm_up": 1.0}, {"growth_mb": 0.0}, {"ratio": 1.0}])
def test_limits_without_meaning_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError, match="expected a warm-up from 0 to 1"):
        Limits(**wrong)
