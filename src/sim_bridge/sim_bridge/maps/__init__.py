# SPDX-License-Identifier: Apache-2.0
"""The project's own maps: drawn by `draw`, found by name with `shipped_map`."""

from sim_bridge.maps.shipped import ShippedMap, map_names, shipped_map

__all__ = ["ShippedMap", "map_names", "shipped_map"]
