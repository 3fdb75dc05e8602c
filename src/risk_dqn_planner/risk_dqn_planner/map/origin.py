# SPDX-License-Identifier: Apache-2.0
"""Where maps are anchored, and where their nodes say that they lie."""

import math
import re
from dataclasses import dataclass

from risk_dqn_planner.errors import ConfigurationError

EARTH_RADIUS_M = 6_371_000.0

_NODE = re.compile(r"<node\b[^>]*>")
_LATITUDE = re.compile(r"\blat\s*=\s*['\"]([^'\"]+)['\"]")
_LONGITUDE = re.compile(r"\blon\s*=\s*['\"]([^'\"]+)['\"]")


@dataclass(frozen=True)
class MapOrigin:
    """Where the map frame's projection is anchored; the vehicle's pose must use the same."""

    latitude_deg: float
    longitude_deg: float

    def __post_init__(self) -> None:
        if not (abs(self.latitude_deg) <= 90.0 and abs(self.longitude_deg) <= 180.0):
            raise ConfigurationError(
                f"map origin ({self}) expected latitude within 90 and longitude within 180 degrees"
            )

    @classmethod
    def from_text(cls, text: str) -> "MapOrigin":
        """Read "latitude,longitude" in degrees.

        Raises:
            ConfigurationError: the text is not two numbers, or they are out of range.
        """
        try:
            latitude, longitude = (float(part) for part in text.split(","))
        except ValueError as error:
            raise ConfigurationError(
                f"map origin is {text!r}, expected latitude,longitude such as 49.0,8.4"
            ) from error
        return cls(latitude, longitude)

    def __str__(self) -> str:
        return f"{self.latitude_deg:.6g},{self.longitude_deg:.6g}"

    def distance_m(self, other: "MapOrigin") -> float:
        """Return the great-circle distance (haversine) [m]."""
        lat1, lat2 = math.radians(self.latitude_deg), math.radians(other.latitude_deg)
        half_lat = 0.5 * (lat2 - lat1)
        half_lon = 0.5 * math.radians(other.longitude_deg - self.longitude_deg)
        a = math.sin(half_lat) ** 2 + math.cos(lat1) * math.cos(lat2) * math.sin(half_lon) ** 2
        return 2.0 * EARTH_RADIUS_M * math.asin(min(1.0, math.sqrt(a)))


def node_positions(text: str) -> tuple[MapOrigin | None, MapOrigin | None]:
    """Return the first node's position in a map file's text, and the median over all nodes."""
    latitudes, longitudes = [], []
    for node in _NODE.findall(text):
        latitude, longitude = _LATITUDE.search(node), _LONGITUDE.search(node)
        try:
            if latitude and longitude:
                position = MapOrigin(float(latitude[1]), float(longitude[1]))
                latitudes.append(position.latitude_deg)
                longitudes.append(position.longitude_deg)
        except (ValueError, ConfigurationError):
            continue
    if not latitudes:
        return None, None
    first = MapOrigin(latitudes[0], longitudes[0])
    middle = len(latitudes) // 2
    return first, MapOrigin(sorted(latitudes)[middle], sorted(longitudes)[middle])
