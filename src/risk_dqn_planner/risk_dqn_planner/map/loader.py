# SPDX-License-Identifier: Apache-2.0
"""Loads a Lanelet2 map and says in a sentence what is wrong with one that cannot be used."""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lanelet2
from lanelet2.projection import LocalCartesianProjector, MercatorProjector, UtmProjector

from risk_dqn_planner.errors import (
    ConfigurationError,
    MapFileError,
    MapProjectionError,
    UnknownLaneletError,
)

# lanelet2's Python objects carry no types.
Lanelet = Any
LineString = Any
LaneletMap = Any
Projector = Any
TrafficRules = Any
RegulatoryElement = Any

LOCAL_XY = "local_xy"
PROJECTORS: dict[str, Projector] = {
    "utm": UtmProjector,
    "local_cartesian": LocalCartesianProjector,
    "mercator": MercatorProjector,
}
# Farther from its origin, a flat map of a crossing is a mistake, not a choice.
MAX_ORIGIN_DISTANCE_M = 20_000.0
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


@dataclass(frozen=True, eq=False)
class RoadMap:
    """A Lanelet2 map with what is needed to drive on it.

    lanelet_map, routing_graph, traffic_rules: lanelet2's own objects, for vehicles.
    origin: None for maps in local coordinates.
    notes: sentences on what the file contained that could not be read.
    """

    path: Path
    lanelet_map: LaneletMap
    routing_graph: Any
    traffic_rules: TrafficRules
    projector: str
    origin: MapOrigin | None
    notes: tuple[str, ...]

    def lanelet(self, lanelet_id: int) -> Lanelet:
        """Return a lanelet by its id.

        Raises:
            UnknownLaneletError: the map has no such lanelet.
        """
        layer = self.lanelet_map.laneletLayer
        # Ids are 64 bit integers; larger ones cannot even be asked for.
        if abs(lanelet_id) >= 2**63 or not layer.exists(lanelet_id):
            raise UnknownLaneletError(
                f"lanelet {lanelet_id} is not among the {len(layer)} lanelets of {self.path}"
            )
        return layer[lanelet_id]

    def drivable(self, lanelet: Lanelet) -> bool:
        """Tell whether a vehicle may drive along the lanelet in its direction."""
        return bool(self.traffic_rules.canPass(lanelet))

    def following(self, lanelet: Lanelet) -> list[Lanelet]:
        """Return the lanelets that a vehicle can go on to, by id."""
        return sorted(self.routing_graph.following(lanelet), key=lanelet_key)

    def previous(self, lanelet: Lanelet) -> list[Lanelet]:
        """Return the lanelets that lead here, by id."""
        return sorted(self.routing_graph.previous(lanelet), key=lanelet_key)


def lanelet_key(lanelet: Lanelet) -> tuple[int, bool]:
    """Identify a lanelet in one driving direction; two-way ones appear in both."""
    return int(lanelet.id), bool(lanelet.inverted())


def load_map(
    path: str | Path,
    origin: MapOrigin | None = None,
    projector: str = "utm",
    location: str = "de",
) -> RoadMap:
    """Load a Lanelet2 map (.osm) for vehicles.

    Args:
        path: the map's file.
        origin: anchor of the projection; without one, the map's first node.
        projector: "utm", "local_cartesian", "mercator", or "local_xy" for maps whose nodes
            carry local_x and local_y tags (Autoware).
        location: country code of the traffic rules, as lanelet2 knows it.

    Raises:
        MapFileError: the file is missing, unreadable, no Lanelet2 map, or has no lanelet.
        MapProjectionError: the map lies far from the origin, or has no such coordinates.
        ConfigurationError: unknown projector or location.
    """
    if projector != LOCAL_XY and projector not in PROJECTORS:
        valid = ", ".join([*PROJECTORS, LOCAL_XY])
        raise ConfigurationError(f"unknown map projector {projector!r}, expected one of {valid}")
    path = Path(path)
    text = _read(path)
    if projector == LOCAL_XY:
        origin = None
        lanelet_map, errors = _parse(path, MercatorProjector(lanelet2.io.Origin(0.0, 0.0)))
        lanelet_map = _in_local_coordinates(path, lanelet_map)
    else:
        origin = _checked_origin(path, text, origin)
        anchor = lanelet2.io.Origin(origin.latitude_deg, origin.longitude_deg)
        lanelet_map, errors = _parse(path, PROJECTORS[projector](anchor))
    if len(lanelet_map.laneletLayer) == 0:
        reason = f" ({errors[0]})" if errors else ""
        raise MapFileError(f"{path} has no lanelet that can be read{reason}")
    rules = _traffic_rules(location)
    return RoadMap(
        path=path,
        lanelet_map=lanelet_map,
        routing_graph=lanelet2.routing.RoutingGraph(lanelet_map, rules),
        traffic_rules=rules,
        projector=projector,
        origin=origin,
        notes=tuple(f"the map's file: {error}" for error in errors),
    )


def _read(path: Path) -> str:
    """Return the file's text after checking that it can be a Lanelet2 map."""
    if path.suffix != ".osm":
        raise MapFileError(f"{path} is not named as a Lanelet2 map, expected a file ending in .osm")
    if not path.is_file():
        raise MapFileError(f"{path} does not exist or is not a file, expected a Lanelet2 map")
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise MapFileError(f"{path} cannot be read: {error.strerror}") from error
    if "<osm" not in text:
        raise MapFileError(f"{path} is not an OSM file, it lacks an <osm> element")
    return text


def _parse(path: Path, projector: Projector) -> tuple[LaneletMap, list[str]]:
    """Parse what can be parsed, and tell what could not, one sentence each."""
    try:
        lanelet_map, errors = lanelet2.io.loadRobust(str(path), projector)
    except RuntimeError as error:
        raise MapFileError(f"{path} cannot be parsed: {error}") from error
    # The first line only announces the list, each further one stands for itself.
    lines = [line.strip(" \t-") for error in errors for line in str(error).splitlines()]
    return lanelet_map, [line for line in lines if line and not line.endswith(":")]


def _checked_origin(path: Path, text: str, origin: MapOrigin | None) -> MapOrigin:
    """Return the origin to use, refusing one that the map does not lie at."""
    first, middle = _node_positions(text)
    if first is None or middle is None:
        raise MapProjectionError(
            f"{path} gives no node a latitude and longitude{_local_hint(text)}"
        )
    if origin is None:
        return first
    distance_m = origin.distance_m(middle)
    if distance_m > MAX_ORIGIN_DISTANCE_M:
        raise MapProjectionError(
            f"{path} lies {distance_m / 1000.0:.0f} km from the origin {origin}, expected an "
            f"origin on the map such as {first}{_local_hint(text)}"
        )
    return origin


def _node_positions(text: str) -> tuple[MapOrigin | None, MapOrigin | None]:
    """Return the first node's position and the median over all nodes."""
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


def _local_hint(text: str) -> str:
    """Point at the local coordinates where the map carries them."""
    return f'; its nodes carry local_x, so try projector "{LOCAL_XY}"' if "local_x" in text else ""


def _in_local_coordinates(path: Path, lanelet_map: LaneletMap) -> LaneletMap:
    """Return the map with its points moved to their local_x and local_y tags."""
    for point in lanelet_map.pointLayer:
        attributes = point.attributes
        try:
            point.x = float(attributes["local_x"])
            point.y = float(attributes["local_y"])
        except (KeyError, ValueError) as error:
            raise MapProjectionError(
                f"point {point.id} of {path} has no numbers in its local_x and local_y tags, "
                f"expected a projector among {', '.join(PROJECTORS)}"
            ) from error
    # A map indexes its elements where they lay when they were added.
    moved = lanelet2.core.LaneletMap()
    for lanelet in lanelet_map.laneletLayer:
        lanelet.resetCache()
    for layer in (lanelet_map.laneletLayer, lanelet_map.lineStringLayer):
        for element in layer:
            moved.add(element)
    for element in lanelet_map.regulatoryElementLayer:
        moved.add(element)
    return moved


def _traffic_rules(location: str) -> TrafficRules:
    """Return lanelet2's rules for vehicles."""
    try:
        return lanelet2.traffic_rules.create(location, lanelet2.traffic_rules.Participants.Vehicle)
    except RuntimeError as error:
        raise ConfigurationError(
            f"lanelet2 has no traffic rules for location {location!r}, expected one such as 'de'"
        ) from error
