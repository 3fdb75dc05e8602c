# SPDX-License-Identifier: Apache-2.0
"""How the ego carries out an action, and how other vehicles move under an acceleration."""

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.decision import Action
from risk_dqn_planner.risk.motion import distance_after, speed_after

_SLOW = int(Action.SLOW)
_FAST = int(Action.FAST)


@kernel
def target_speed(action: int, slow_mps: float, fast_mps: float) -> float:
    """Return the speed an action aims at: 0 for Stop."""
    if action == _FAST:
        return fast_mps
    return slow_mps if action == _SLOW else 0.0


@kernel
def follow_target(
    speed_mps: float,
    target_mps: float,
    time_s: float,
    acceleration_mps2: float,
    braking_mps2: float,
) -> tuple[float, float]:
    """Return (distance, speed) after `time_s`: exact, without overshooting the target speed."""
    return (
        distance_after(time_s, speed_mps, target_mps, acceleration_mps2, braking_mps2),
        speed_after(time_s, speed_mps, target_mps, acceleration_mps2, braking_mps2),
    )


@kernel
def accelerate(speed_mps: float, acceleration_mps2: float, time_s: float) -> tuple[float, float]:
    """Return (distance, speed) after `time_s` of constant acceleration; stops at standstill."""
    end_mps = speed_mps + acceleration_mps2 * time_s
    if end_mps < 0.0:
        return -0.5 * speed_mps * speed_mps / acceleration_mps2, 0.0
    return 0.5 * (speed_mps + end_mps) * time_s, end_mps
