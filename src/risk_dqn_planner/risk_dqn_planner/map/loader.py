# SPDX-License-Identifier: Apache-2.0
"""Loads a Lanelet2 map and says in a sentence what is wrong with one that cannot be used."""

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
from risk_dqn_planner.map.origin import MapOrigin, node_positions
from risk_dqn_planner.map.osm import LaneletMap, Projector, load_local, parse, read

__all__ = [
    "Lanelet",
    "LineString",
    "MapOrigin",
    "RegulatoryElement",
    "RoadMap",
    "lanelet_key",
    "load_map",
]

# lanelet2's Python objects carry no types.
Lanelet = Any
LineString = Any
TrafficRules = Any
RegulatoryElement = Any

LOCAL_XY = "local_xy"
PROJECTORS: dict[str, Projector] = {
    "utm": UtmProjector,
    "local_cartesian": LocalCartesianProjector,
    "mercator": MercatorProjector,
}
ALL_PROJECTORS = (*PROJECTORS, LOCAL_XY)
DEFAULT_PROJECTOR = "utm"
# Farther from its origin, a flat map of a crossing is a mistake, not a choice.
MAX_ORIGIN_DISTANCE_M = 20_000.0


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
    projector: str = DEFAULT_PROJECTOR,
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
    if projector not in ALL_PROJECTORS:
        valid = ", ".join(ALL_PROJECTORS)
        raise ConfigurationError(f"unknown map projector {projector!r}, expected one of {valid}")
    path = Path(path)
    text = read(path)
    if projector == LOCAL_XY:
        origin = None
        lanelet_map, errors = load_local(path)
    else:
        origin = _checked_origin(path, text, origin)
        anchor = lanelet2.io.Origin(origin.latitude_deg, origin.longitude_deg)
        lanelet_map, errors = parse(path, PROJECTORS[projector](anchor))
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


def _checked_origin(path: Path, text: str, origin: MapOrigin | None) -> MapOrigin:
    """Return the origin to use, refusing one that the map does not lie at."""
    first, middle = node_positions(text)
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


def _local_hint(text: str) -> str:
    """Point at the local coordinates where the map carries them."""
    return f'; its nodes carry local_x, so try projector "{LOCAL_XY}"' if "local_x" in text else ""


def _traffic_rules(location: str) -> TrafficRules:
    """Return lanelet2's rules for vehicles."""
    try:
        return lanelet2.traffic_rules.create(location, lanelet2.traffic_rules.Participants.Vehicle)
    except RuntimeError as error:
        raise ConfigurationError(
            f"lanelet2 has no traffic rules for location {location!r}, expected one such as 'de'"
        ) from error
