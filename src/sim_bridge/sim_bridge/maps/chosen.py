# SPDX-License-Identifier: Apache-2.0
"""The map and the route that a user has chosen: an own map by its name, or any Lanelet2 file."""

import argparse
from pathlib import Path
from typing import NamedTuple

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.map.loader import ALL_PROJECTORS, DEFAULT_PROJECTOR, MapOrigin
from risk_dqn_planner.map.route import parse_route
from sim_bridge.maps.shipped import shipped_map


class ChosenMap(NamedTuple):
    """A map's file, the ego's route on it, and its origin, None for that of the first node."""

    path: Path
    route: tuple[int, ...]
    origin: MapOrigin | None


def chosen_map(
    name: str, route: tuple[int, ...] | None = None, origin: MapOrigin | None = None
) -> ChosenMap:
    """Return a map by its name or file; an own map brings the route and origin not given.

    Raises:
        MapFileError: no own map has that name.
        ConfigurationError: a file without a route.
    """
    if not name.endswith(".osm"):
        own = shipped_map(name)
        return ChosenMap(own.path, route or own.route, origin or own.origin)
    if route is None:
        raise ConfigurationError(f"{name} is no own map, so its route must be given")
    return ChosenMap(Path(name), route, origin)


def add_map_file_options(parser: argparse.ArgumentParser) -> None:
    """Declare what a map needs beside its file, for `route_and_origin` and `load_map`."""
    parser.add_argument("--route", help="lanelet ids, separated by commas; own maps have one")
    parser.add_argument("--origin", help="latitude,longitude of the map's projection [deg]")
    parser.add_argument(
        "--projector",
        default=DEFAULT_PROJECTOR,
        help=f"of the map: {', '.join(ALL_PROJECTORS)} [%(default)s]",
    )


def route_and_origin(
    route: str | None, origin: str | None
) -> tuple[tuple[int, ...] | None, MapOrigin | None]:
    """Read both options of a command line, None where they are not given.

    Raises:
        ConfigurationError: one of them is no list of ids, or no place.
    """
    return (
        parse_route(route) if route else None,
        MapOrigin.from_text(origin) if origin else None,
    )
