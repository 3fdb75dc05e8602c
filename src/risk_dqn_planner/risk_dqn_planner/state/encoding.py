# SPDX-License-Identifier: Apache-2.0
"""One scene as the network sees it: what is selected, and how it is normalised (docs/paper.md).

A scene is 3 x 8, rows by kind of quantity, columns [ego | 5 vehicles | 2 lanes]:
row 0: d_e,stl, d_i, d_o; row 1: v_e, v_i, v_o; row 2: d_e,goal, d_e,i, d_e,o.
"""

import math
from dataclasses import dataclass, fields
from typing import NamedTuple

from risk_dqn_planner.compiled import elementwise
from risk_dqn_planner.errors import ConfigurationError

SCENES = 5
ROWS = 3
VEHICLES = 5
LANES = 2
COLUMNS = 1 + VEHICLES + LANES
TAKEN = -1.0  # less than any criticality
LAYOUT = "scenes (now first) x (distance, speed, ego distance) x (ego, 5 vehicles, 2 lanes)"


class StateParameters(NamedTuple):
    """StateConfig as the numbers that kernels read; fields as there."""

    stop_line_max_m: float
    goal_max_m: float
    vehicle_max_m: float
    hidden_max_m: float
    ego_zone_max_m: float
    ego_speed_max_mps: float
    speed_max_mps: float
    stacked: bool


@dataclass(frozen=True)
class StateConfig:
    """d_max of each distance, the maximum of each speed, and what history means.

    The paper names no d_max; these cover its sensor range of 70 m. stacked: whole scenes are
    stacked with their slots as they were, the paper's words; otherwise every vehicle and lane
    chosen now brings its own history, which is what its network asks for (docs/paper.md).
    """

    stop_line_max_m: float = 70.0
    goal_max_m: float = 100.0
    vehicle_max_m: float = 70.0
    hidden_max_m: float = 70.0
    ego_zone_max_m: float = 70.0
    ego_speed_max_mps: float = 5.0
    speed_max_mps: float = 15.0
    stacked: bool = False

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name != "stacked" and not 0.0 < value < math.inf:
                raise ConfigurationError(
                    f"StateConfig.{field.name} is {value}, expected a finite number above 0"
                )

    def parameters(self) -> StateParameters:
        """Return the numbers that kernels read."""
        return StateParameters(*(getattr(self, name) for name in StateParameters._fields))


@elementwise
def encode_distance(distance_m: float, max_m: float) -> float:
    """Map a distance to [-1, 1] with more resolution near 0 (paper, y = sqrt(x / d_max)).

    Negative distances map to -sqrt(|x| / d_max); beyond d_max the value is clipped.
    """
    return math.copysign(math.sqrt(min(abs(distance_m) / max_m, 1.0)), distance_m)


@elementwise
def encode_speed(speed_mps: float, max_mps: float) -> float:
    """Map a speed linearly to [-1, 1], clipped."""
    return max(-1.0, min(speed_mps / max_mps, 1.0))


@elementwise
def criticality(distance: float, ego_distance: float) -> float:
    """Return c_i of two encoded distances (paper, equation of c_i): 1 at the zone, 0 far off."""
    return 1.0 - math.sqrt(0.5 * (distance * distance + ego_distance * ego_distance))
