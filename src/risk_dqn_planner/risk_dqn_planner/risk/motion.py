# SPDX-License-Identifier: Apache-2.0
"""Motion along a path in closed form: constant acceleration up to a speed that is then kept.

The paper gives only the case "zero initial velocity, maximum velocity not reached" (section
"Risk Reward"); here any start speed and the top speed are covered (docs/paper.md). All functions
are elementwise and may be called from kernels. Distances [m], speeds [m/s], times [s].
"""

import math

from risk_dqn_planner.compiled import elementwise


@elementwise
def time_to_cover(
    distance_m: float, speed_mps: float, acceleration_mps2: float, top_speed_mps: float
) -> float:
    """Return the earliest time at which `distance_m` is covered, accelerating up to top speed.

    0 where the distance is already covered (<= 0), infinity where it never will be. A start
    above top speed is kept; a negative start speed first runs backwards.
    """
    if distance_m <= 0.0:
        return 0.0
    if speed_mps >= top_speed_mps:
        return distance_m / speed_mps if speed_mps > 0.0 else math.inf
    speed_at_end = math.sqrt(speed_mps * speed_mps + 2.0 * acceleration_mps2 * distance_m)
    if speed_at_end > top_speed_mps:
        ramp_s = (top_speed_mps - speed_mps) / acceleration_mps2
        ramp_m = 0.5 * (speed_mps + top_speed_mps) * ramp_s
        return ramp_s + (distance_m - ramp_m) / top_speed_mps
    if speed_mps < 0.0:
        # The form below would cancel; only a negative start speed needs an acceleration above 0.
        if acceleration_mps2 <= 0.0:
            return math.inf
        return (speed_at_end - speed_mps) / acceleration_mps2
    # (speed_at_end - speed) / acceleration without its cancellation, and fine at 0 acceleration.
    mean_mps = 0.5 * (speed_mps + speed_at_end)
    return distance_m / mean_mps if mean_mps > 0.0 else math.inf


@elementwise
def speed_after(
    time_s: float,
    speed_mps: float,
    target_mps: float,
    acceleration_mps2: float,
    braking_mps2: float,
) -> float:
    """Return the speed after `time_s` of approaching a target speed and then keeping it."""
    if speed_mps < target_mps:
        return min(target_mps, speed_mps + acceleration_mps2 * time_s)
    return max(target_mps, speed_mps - braking_mps2 * time_s)


@elementwise
def distance_after(
    time_s: float,
    speed_mps: float,
    target_mps: float,
    acceleration_mps2: float,
    braking_mps2: float,
) -> float:
    """Return the distance covered in `time_s` of approaching a target speed and keeping it."""
    rate_mps2 = acceleration_mps2 if speed_mps < target_mps else -braking_mps2
    change_mps = target_mps - speed_mps
    if abs(change_mps) >= abs(rate_mps2) * time_s:
        return (speed_mps + 0.5 * rate_mps2 * time_s) * time_s
    ramp_s = change_mps / rate_mps2
    return 0.5 * (speed_mps + target_mps) * ramp_s + target_mps * (time_s - ramp_s)


@elementwise
def time_to_travel(
    distance_m: float,
    speed_mps: float,
    target_mps: float,
    acceleration_mps2: float,
    braking_mps2: float,
) -> float:
    """Return when `distance_m` is covered while approaching a target speed and then keeping it.

    The inverse of `distance_after`: infinity where the motion comes to rest before.
    """
    if distance_m <= 0.0:
        return 0.0
    if speed_mps < target_mps:
        time_s: float = time_to_cover(distance_m, speed_mps, acceleration_mps2, target_mps)
        return time_s
    ramp_m = 0.5 * (speed_mps * speed_mps - target_mps * target_mps) / braking_mps2
    if distance_m <= ramp_m:
        speed_at_end = math.sqrt(speed_mps * speed_mps - 2.0 * braking_mps2 * distance_m)
        return 2.0 * distance_m / (speed_mps + speed_at_end)
    if target_mps <= 0.0:
        return math.inf
    return (speed_mps - target_mps) / braking_mps2 + (distance_m - ramp_m) / target_mps
