# SPDX-License-Identifier: Apache-2.0
"""Random numbers that depend on nothing but (seed, stream, index): no generator has a state.

So an episode is the same in a batch of one or 1000, and whatever else was drawn before. The
bits are those of SplitMix64 (Steele, Lea, Flood 2014), its mixing function applied to the seed,
then to the stream, then to the index.
"""

import math

import numpy as np

from risk_dqn_planner.compiled import kernel

# What a number is drawn for; every stream has its own sequence. Written as numpy's numbers, because
# kernels are compiled anew for each of Python's.
EGO_STREAM = np.int64(0)
OBSTACLE_STREAM = np.int64(1)
COUNT_STREAM = np.int64(2)
VEHICLE_STREAM = np.int64(3)
PLACE_STREAM = np.int64(4)
NOISE_STREAM = np.int64(5)
MISSED_STREAM = np.int64(6)
PHANTOM_STREAM = np.int64(7)

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_SHIFT_30, _SHIFT_27, _SHIFT_31 = np.uint64(30), np.uint64(27), np.uint64(31)
_SHIFT_11 = np.uint64(11)
_ONE = np.uint64(1)


@kernel
def _mix(bits: np.uint64) -> np.uint64:
    """Return the output function of SplitMix64."""
    bits = (bits ^ (bits >> _SHIFT_30)) * _FIRST
    bits = (bits ^ (bits >> _SHIFT_27)) * _SECOND
    return bits ^ (bits >> _SHIFT_31)


@kernel
def random_bits(seed: np.uint64, stream: np.int64, index: np.int64 | int) -> np.uint64:
    """Return 64 random bits."""
    key = _mix(np.uint64(seed) + _GOLDEN)
    key = _mix(key + (np.uint64(stream) + _ONE) * _GOLDEN)
    return _mix(key + (np.uint64(index) + _ONE) * _GOLDEN)


@kernel
def random_share(seed: np.uint64, stream: np.int64, index: np.int64 | int) -> float:
    """Return a number uniform in [0, 1)."""
    return np.float64(random_bits(seed, stream, index) >> _SHIFT_11) * 2.0**-53


@kernel
def random_between(
    seed: np.uint64, stream: np.int64, index: np.int64 | int, low: float, high: float
) -> float:
    """Return a number uniform in [low, high)."""
    return low + (high - low) * random_share(seed, stream, index)


@kernel
def random_index(seed: np.uint64, stream: np.int64, index: np.int64 | int, count: int) -> int:
    """Return a whole number uniform in 0 .. count - 1."""
    return min(int(random_share(seed, stream, index) * count), count - 1)


@kernel
def random_normal(seed: np.uint64, stream: np.int64, index: np.int64 | int) -> float:
    """Return a standard normal number (Box and Muller 1958); uses the indices 2i and 2i + 1."""
    radius = math.sqrt(-2.0 * math.log(1.0 - random_share(seed, stream, 2 * index)))
    return radius * math.cos(2.0 * math.pi * random_share(seed, stream, 2 * index + 1))
