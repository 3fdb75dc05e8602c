# SPDX-License-Identifier: Apache-2.0
"""Where vehicles enter in sight of the ego, since the map begins there."""

import math

from sim_bridge.world.world import World


def entries_in_range(world: World) -> dict[int, float]:
    """Return the lanes whose vehicles enter within the sensor's range, by their ids.

    Each with how far before its zone the nearest of them enters [m]. Nobody appears out of
    nothing: while the ego sees that place nobody enters, so that traffic is thinner than the
    scenario says for whoever stands where it sees far.
    """
    paths, found = world.paths, dict[int, float]()
    for path in world.lanes.entry_path:
        if not paths.entry_is_far[path]:
            lane = int(world.lanes.id[paths.lane[path]])
            found[lane] = min(found.get(lane, math.inf), float(paths.zone_m[path]))
    return found
