# SPDX-License-Identifier: Apache-2.0
"""Finds the project's own maps, in the sources or where they are installed."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from risk_dqn_planner.errors import MapFileError
from risk_dqn_planner.map.loader import MapOrigin

INDEX = "maps.yaml"


@dataclass(frozen=True)
class ShippedMap:
    """A map of the project: where it lies, what anchors it, and the ego's way through it."""

    name: str
    path: Path
    origin: MapOrigin
    route: tuple[int, ...]


def maps_folder() -> Path:
    """Return the maps' folder: beside the package in the sources, under share/ if installed.

    Raises:
        MapFileError: the folder is in neither place.
    """
    for parent in Path(__file__).resolve().parents:
        for folder in (parent / "maps", parent / "share" / "sim_bridge" / "maps"):
            if (folder / INDEX).is_file():
                return folder
    raise MapFileError(f"the project's maps are not installed: no maps/{INDEX} near {__file__}")


def _index() -> dict[str, dict[str, Any]]:
    """Return what maps.yaml says of each map, by its name."""
    index: dict[str, dict[str, Any]] = yaml.safe_load((maps_folder() / INDEX).read_text())
    return index


def map_names() -> list[str]:
    """Return the names of the project's maps."""
    return list(_index())


def shipped_map(name: str) -> ShippedMap:
    """Return a map of the project by its name.

    Raises:
        MapFileError: the project has no map of that name.
    """
    index = _index()
    if name not in index:
        raise MapFileError(f"there is no map {name!r}, expected one of {', '.join(index)}")
    entry = index[name]
    return ShippedMap(
        name=name,
        path=maps_folder() / entry["file"],
        origin=MapOrigin(*entry["origin"]),
        route=tuple(entry["route"]),
    )
