# SPDX-License-Identifier: Apache-2.0
"""How near to a place the ego can come to rest by short hops, each of whole decision periods.

Where a corner hides a lane, decimetres decide: the ego sees along its line past the corner, and a
little further ahead that turns by a lot. But it cannot go back, and the shortest hop from rest
takes it a quarter of a metre. So what is left to the line is to be spent on hops that fit.
"""

import functools
import itertools

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.safety.assumptions import SafetyNumbers
from risk_dqn_planner.situation.situations import Floats

# Further away than this everything can be reached.
FAR_M = 3.0
_GRAIN_M = 0.005
_LONGEST_HOP = 5


@functools.lru_cache(maxsize=16)
def shortfalls(p: SafetyNumbers) -> Floats:
    """Return how far short of a place an ego ends at best that rests k grains before it (K,).

    To be read only: whoever asks again gets the same array, since finding it takes milliseconds.
    """
    count = int(FAR_M / _GRAIN_M) + 1
    reached = np.zeros(count, dtype=np.bool_)
    reached[0] = True
    hops = sorted({int(np.ceil(hop_m / _GRAIN_M)) for hop_m in _hops(p) if hop_m < FAR_M})
    for k in range(1, count):
        reached[k] = any(hop <= k and reached[k - hop] for hop in hops)
    last = np.maximum.accumulate(np.where(reached, np.arange(count), 0))
    return np.asarray((np.arange(count) - last) * _GRAIN_M)


def _hops(p: SafetyNumbers) -> list[float]:
    """Return the ways from rest to rest by a few periods of Slow or Fast, then braking."""
    found = []
    for periods in range(1, _LONGEST_HOP + 1):
        for targets in itertools.product((p.slow_mps, p.fast_mps), repeat=periods):
            way_m, mps = 0.0, 0.0
            for target_mps in targets:
                limits = p.ego_up_mps2, p.ego_down_mps2
                way_m += float(distance_after(p.period_s, mps, target_mps, *limits))
                mps = float(speed_after(p.period_s, mps, target_mps, *limits))
            found.append(way_m + 0.5 * mps * mps / p.ego_down_mps2)
    return found


@kernel
def short_of(shortfall_m: Floats, left_m: float) -> float:
    """Return how far short of a place an ego ends at best that would rest `left_m` before it."""
    k = int(left_m / _GRAIN_M)
    return shortfall_m[k] if 0 <= k < len(shortfall_m) else 0.0
