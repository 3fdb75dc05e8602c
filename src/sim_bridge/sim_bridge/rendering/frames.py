# SPDX-License-Identifier: Apache-2.0
"""One moment of an episode as pictures need it, whether it was simulated here or recorded."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.decision import Action

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class VehicleFrame:
    """A vehicle: footprint's centre [m], heading [rad], speed [m/s]; hidden from the ego or not."""

    id: int
    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    length_m: float
    width_m: float
    hidden: bool = False


@dataclass(frozen=True)
class Frame:
    """A moment of an episode, in the map's frame.

    time_s: since the episode's start. action: decision in force, None before the first one.
    obstacles: polygons (K, 2). visible_area (K, 2): what the ego sees, None if unknown.
    reason: why the action was chosen, one line.
    """

    time_s: float
    ego: VehicleFrame
    action: Action | None
    vehicles: tuple[VehicleFrame, ...]
    obstacles: tuple[Floats, ...]
    visible_area: Floats | None = None
    reason: str = ""
