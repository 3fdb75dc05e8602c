# SPDX-License-Identifier: Apache-2.0
"""The project's own maps: drawn by `draw`, found by name with `shipped_map`; and users' own."""

from sim_bridge.maps.chosen import (
    ChosenMap,
    add_map_file_options,
    chosen_map,
    route_and_origin,
)
from sim_bridge.maps.shipped import ShippedMap, map_names, shipped_map

__all__ = [
    "ChosenMap",
    "ShippedMap",
    "add_map_file_options",
    "chosen_map",
    "map_names",
    "route_and_origin",
    "shipped_map",
]
