# SPDX-License-Identifier: Apache-2.0
"""Whether something that is sampled now and then grows: plain Python, without ROS 2.

A single step, such as an allocator fetching another page, is no growth, and neither is the climb
while caches fill. Hence the Theil-Sen slope, the median of the slopes between all pairs of samples,
which a quarter of stray samples does not bend, taken after the warm-up.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from risk_dqn_planner.errors import ConfigurationError

_MOST_POINTS = 400  # of which all pairs are formed
_END = 0.1  # share of the samples that make up a beginning or an end


@dataclass(frozen=True)
class Limits:
    """What counts as flat.

    warm_up: share of the time at the beginning that does not count. growth_mb: the most that
    memory may grow in an hour of simulated time, by its slope, and in all where it was less.
    ratio: the most that the end (its median) may be of the beginning after the warm-up.
    """

    warm_up: float = 0.2
    growth_mb: float = 5.0
    ratio: float = 1.05

    def __post_init__(self) -> None:
        if not (0.0 <= self.warm_up < 1.0 and self.growth_mb > 0.0 and self.ratio > 1.0):
            raise ConfigurationError(
                f"limits are {self}, expected a warm-up from 0 to 1, and a growth and a ratio "
                "above 0 and 1"
            )


@dataclass(frozen=True)
class Trend:
    """How a quantity changed after the warm-up.

    slope_per_h: Theil-Sen slope by the hour. begin, end: medians over the first and the last tenth
    of the samples. span_h: time between the first and the last sample that count.
    """

    slope_per_h: float
    begin: float
    end: float
    span_h: float

    @property
    def growth(self) -> float:
        """How much it grew in an hour, or over the whole span where that is shorter."""
        return self.slope_per_h * min(self.span_h, 1.0)

    @property
    def ratio(self) -> float:
        """The end by the beginning."""
        return self.end / self.begin


def theil_sen(x: ArrayLike, y: ArrayLike) -> float:
    """Return the median of the slopes between all pairs of points with different x.

    x, y: (N,), x in any order.

    Raises:
        ValueError: no two points differ in x.
    """
    across, up = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    first, second = np.triu_indices(len(across), k=1)
    run = across[second] - across[first]
    differ = run != 0.0
    if not differ.any():
        raise ValueError("a slope needs two points at different places")
    return float(np.median((up[second] - up[first])[differ] / run[differ]))


def trend(hours: Sequence[float], values: Sequence[float], warm_up: float) -> Trend:
    """Return how values, sampled at rising times [h], change after the warm-up.

    Raises:
        ValueError: less than two samples are left of it.
    """
    x, y = np.asarray(hours, dtype=np.float64), np.asarray(values, dtype=np.float64)
    counts = x >= x[0] + warm_up * (x[-1] - x[0])
    x, y = x[counts], y[counts]
    few = thinned(len(x), _MOST_POINTS)
    edge = max(1, round(_END * len(x)))
    return Trend(
        slope_per_h=theil_sen(x[few], y[few]),
        begin=float(np.median(y[:edge])),
        end=float(np.median(y[-edge:])),
        span_h=float(x[-1] - x[0]),
    )


def thinned(count: int, most: int) -> NDArray[np.int64]:
    """Return at most so many of the numbers from 0 to count - 1, evenly spread, with both ends."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
