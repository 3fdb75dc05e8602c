# SPDX-License-Identifier: Apache-2.0
"""Where the ego and a vehicle of a merging lane are on the path that both have behind the join."""

from risk_dqn_planner.compiled import elementwise


@elementwise
def leader_gap(ego_distance_m: float, ego_zone_m: float, distance_m: float, zone_m: float) -> float:
    """Return how far a vehicle is ahead of the ego on the common path behind a join [m].

    Both zones of a merging lane end at the join, half a zone behind their centres. The ego has
    d_e + l_e/2 to go to it, the vehicle d + l/2 (negative once it has joined); the difference
    is the distance between the centres along the path.
    """
    return (ego_distance_m + 0.5 * ego_zone_m) - (distance_m + 0.5 * zone_m)
