# SPDX-License-Identifier: Apache-2.0
"""How far perceived things may go before they count as impossible."""

from dataclasses import dataclass, field
from typing import Any

from risk_dqn_planner.vehicle import require_in_range


def _limit(default: float, description: str, minimum: float, maximum: float) -> Any:  # noqa: ANN401
    """Return a field that becomes a parameter and may change while a node runs."""
    metadata = {
        "description": description,
        "minimum": minimum,
        "maximum": maximum,
        "live": True,
    }
    return field(default=default, metadata=metadata)


@dataclass(frozen=True)
class PlausibilityLimits:
    """What no ego, no vehicle and no visible area on a road can exceed.

    Generous on purpose: noise of a sensor, phantoms and missed detections are for the policy to
    live with, and are no faults. What exceeds these limits is broken.
    """

    max_ego_speed_mps: float = _limit(
        40.0, "An ego that says to be faster is a fault [m/s]", 1.0, 100.0
    )
    ego_jump_m: float = _limit(
        1.0, "The ego may be this much further than its speed explains [m]", 0.01, 100.0
    )
    ego_speed_margin_mps: float = _limit(
        3.0, "Error of the ego's speed, and its change between messages [m/s]", 0.0, 50.0
    )
    ego_turn_rad: float = _limit(
        0.5, "The ego may be turned this much further than its turn rate explains [rad]", 0.01, 3.2
    )
    ego_turn_rate_radps: float = _limit(1.5, "Fastest turning of the ego [rad/s]", 0.1, 10.0)
    ego_frozen_s: float = _limit(
        1.0, "An ego that says to drive, but stays where it is for so long, is a fault [s]",
        0.1, 100.0,
    )  # fmt: skip
    max_object_speed_mps: float = _limit(
        60.0, "An object that is faster is a fault [m/s]", 1.0, 100.0
    )
    object_jump_m: float = _limit(
        3.0, "An object may be this much further than its speed explains [m]", 0.01, 100.0
    )
    object_speed_margin_mps: float = _limit(
        6.0, "Error of an object's speed, and its change between messages [m/s]", 0.0, 50.0
    )
    max_object_length_m: float = _limit(50.0, "A longer object is a fault [m]", 1.0, 1000.0)
    max_object_width_m: float = _limit(6.0, "A wider object is a fault [m]", 1.0, 1000.0)
    max_distance_m: float = _limit(
        1000.0,
        "An object or a corner of the visible area further from the ego is a fault [m]",
        10.0,
        100000.0,
    )
    max_objects: int = _limit(1000, "More objects in one list are a fault", 1, 100000)
    min_visible_area_m2: float = _limit(
        1.0, "A visible area that is smaller is a fault [m^2]", 0.001, 1000.0
    )
    max_visible_corners: int = _limit(
        2000, "A visible area with more corners is a fault", 3, 100000
    )

    def __post_init__(self) -> None:
        require_in_range(self)
