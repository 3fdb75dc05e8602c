# SPDX-License-Identifier: Apache-2.0
"""Reads Lanelet2 files with lanelet2, which says little of what is wrong with them."""

import tempfile
from pathlib import Path
from typing import Any

import lanelet2
from lanelet2.projection import MercatorProjector, UtmProjector

from risk_dqn_planner.errors import MapFileError, MapProjectionError

# lanelet2's Python objects carry no types, or incomplete ones.
LaneletMap = Any
Point = Any
Projector = Any


def read(path: Path) -> str:
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


def parse(path: Path, projector: Projector) -> tuple[LaneletMap, list[str]]:
    """Parse what can be parsed, and tell what could not, one sentence each."""
    try:
        lanelet_map, errors = lanelet2.io.loadRobust(str(path), projector)
    except RuntimeError as error:
        raise MapFileError(f"{path} cannot be parsed: {error}") from error
    # The first line only announces the list, each further one stands for itself.
    lines = [line.strip(" \t-") for error in errors for line in str(error).splitlines()]
    return lanelet_map, [line for line in lines if line and not line.endswith(":")]


def load_local(path: Path) -> tuple[LaneletMap, list[str]]:
    """Load a map by the local_x and local_y tags of its points.

    While loading, lanelet2 finds out from the coordinates in which direction borders run, and
    latitude and longitude may be missing or wrong in such maps. So the map is loaded, moved
    to its local coordinates, written with them, and loaded again.
    """
    drawn, errors = parse(path, MercatorProjector(lanelet2.io.Origin(0.0, 0.0)))
    if len(drawn.pointLayer) == 0:
        return drawn, errors
    _move(path, drawn, _local_position(path, next(iter(drawn.pointLayer))))
    projector = UtmProjector(lanelet2.io.Origin(49.0, 9.0))
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        lanelet2.io.write(str(copy), drawn, projector)
        lanelet_map, _ = parse(copy, projector)
    _move(path, lanelet_map, (0.0, 0.0))
    # A map indexes its elements where they lay when they were added.
    moved = lanelet2.core.LaneletMap()
    for lanelet in lanelet_map.laneletLayer:
        moved.add(lanelet)
    for line in lanelet_map.lineStringLayer:
        moved.add(line)
    for element in lanelet_map.regulatoryElementLayer:
        moved.add(element)
    return moved, errors


def _move(path: Path, lanelet_map: LaneletMap, corner: tuple[float, float]) -> None:
    """Move a map's points to their local coordinates as seen from a corner."""
    for point in lanelet_map.pointLayer:
        x, y = _local_position(path, point)
        point.x, point.y = x - corner[0], y - corner[1]
    for lanelet in lanelet_map.laneletLayer:
        lanelet.resetCache()


def _local_position(path: Path, point: Point) -> tuple[float, float]:
    attributes = point.attributes
    try:
        return float(attributes["local_x"]), float(attributes["local_y"])
    except (KeyError, ValueError) as error:
        raise MapProjectionError(
            f"point {point.id} of {path} has no numbers in its local_x and local_y tags, "
            f"expected both, or a map by latitude and longitude"
        ) from error
