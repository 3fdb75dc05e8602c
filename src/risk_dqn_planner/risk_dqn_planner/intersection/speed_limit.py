# SPDX-License-Identifier: Apache-2.0
"""Speed limits that a map states. lanelet2's own answer hides where it states none (50 km/h)."""

import re
from collections.abc import Iterable

from risk_dqn_planner.map.loader import Lanelet

ATTRIBUTES = ("speed_limit", "speed_limit:vehicle", "speed_limit:vehicle:car")
METRES_PER_SECOND = {
    "": 1 / 3.6,  # as lanelet2: a bare number is in km/h
    "km/h": 1 / 3.6,
    "kmh": 1 / 3.6,
    "kph": 1 / 3.6,
    "mph": 0.44704,
    "m/s": 1.0,
    "mps": 1.0,
}
# German signs 274-30 and the like, as lanelet2 names them: "de274-30".
_SIGN = re.compile(r"^(?:de)?27[34][-.:](\d+)$")
_VELOCITY = re.compile(r"^([0-9]*\.?[0-9]+)\s*([a-z/]*)$")


def parse_speed_limit(text: str) -> float | None:
    """Return a speed limit [m/s] from how maps write it, or None if it cannot be read."""
    text = text.strip().lower()
    sign = _SIGN.match(text)
    if sign:
        return float(sign[1]) * METRES_PER_SECOND["km/h"]
    velocity = _VELOCITY.match(text)
    if velocity is None or velocity[2] not in METRES_PER_SECOND:
        return None
    # Six digits: maps converted between units say 30.000000000000004.
    value = round(float(velocity[1]), 6) * METRES_PER_SECOND[velocity[2]]
    return value if value > 0.0 else None


def highest_speed_limit(lanelets: Iterable[Lanelet]) -> tuple[float | None, list[str]]:
    """Return the highest limit that the map states on these lanelets [m/s], None if nowhere.

    Also returns sentences on limits that could not be read.
    """
    limits: list[float] = []
    notes: list[str] = []
    for lanelet in lanelets:
        for text in _stated(lanelet):
            limit = parse_speed_limit(text)
            if limit is None:
                notes.append(f"speed limit {text!r} of lanelet {lanelet.id} cannot be read")
            else:
                limits.append(limit)
    return max(limits, default=None), notes


def _stated(lanelet: Lanelet) -> list[str]:
    """Return what the map says on a lanelet's limit; signs take the place of attributes."""
    signs = [str(rule.type()) for rule in lanelet.speedLimits()]
    if signs:
        return signs
    attributes = lanelet.attributes
    return [attributes[name] for name in ATTRIBUTES if name in attributes]
