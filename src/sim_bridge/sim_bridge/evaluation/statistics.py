# SPDX-License-Identifier: Apache-2.0
"""Numbers with their 95% intervals."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

Z_95 = 1.959963984540054


class Share(NamedTuple):
    """A share in [0, 1] with its interval."""

    rate: float
    low: float
    high: float


class Mean(NamedTuple):
    """A mean with its interval."""

    mean: float
    low: float
    high: float


def wilson(count: int, of: int) -> Share:
    """Return the share of independent trials with Wilson's interval (Wilson 1927).

    Unlike the usual one it is right near 0 and 1: no collision in n trials is not "no risk".
    """
    if of < 1 or not 0 <= count <= of:
        raise ValueError(f"{count} of {of} is no share")
    rate, z2 = count / of, Z_95 * Z_95
    center = (rate + z2 / (2 * of)) / (1 + z2 / of)
    half = Z_95 * math.sqrt(rate * (1 - rate) / of + z2 / (4 * of * of)) / (1 + z2 / of)
    # Rounding must not put the share outside of its own interval.
    return Share(rate, min(max(center - half, 0.0), rate), max(min(center + half, 1.0), rate))


def mean_interval(values: ArrayLike) -> Mean | None:
    """Return the mean of independent values (N,), None if there are none.

    Normal approximation; the interval of a single value is that value.
    """
    given = np.asarray(values, dtype=np.float64)
    if given.size == 0:
        return None
    mean = float(given.mean())
    spread = float(given.std(ddof=1)) if given.size > 1 else 0.0
    half = Z_95 * spread / math.sqrt(given.size)
    return Mean(mean, mean - half, mean + half)


def ratio_interval(parts: ArrayLike, wholes: ArrayLike) -> Mean | None:
    """Return sum(parts) / sum(wholes) over independent episodes, None if the wholes are 0.

    For what is counted in steps, which are not independent within an episode: the interval is
    that of the ratio estimator (Cochran 1977, section 2.11).
    """
    above, below = np.asarray(parts, dtype=np.float64), np.asarray(wholes, dtype=np.float64)
    if below.sum() <= 0.0:
        return None
    ratio = float(above.sum() / below.sum())
    count = below.size
    if count == 1:
        return Mean(ratio, ratio, ratio)
    residual = above - ratio * below
    error = math.sqrt(float(residual @ residual) / (count * (count - 1))) / float(below.mean())
    return Mean(ratio, ratio - Z_95 * error, ratio + Z_95 * error)
