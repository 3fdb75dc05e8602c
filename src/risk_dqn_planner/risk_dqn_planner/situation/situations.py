# SPDX-License-Identifier: Apache-2.0
"""The lane-based situation of the paper as arrays: a batch, or on the vehicle a batch of one."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]


class Situations(NamedTuple):
    """B situations with room for N (vehicle, lane) pairs and M lanes, in physical units.

    A vehicle that is matched to several intersecting lanes fills several of the N places.
    Entries whose mask is False hold no meaning. Distances are between centres and negative
    once the zone's centre is passed.

    stop_line_distance_m (B,): d_e,stl. goal_distance_m (B,): d_e,goal. ego_speed_mps (B,): v_e.
    vehicle_mask (B, N); vehicle_id (B, N); vehicle_lane (B, N): index into the M lanes;
    vehicle_distance_m (B, N): d_i; vehicle_speed_mps (B, N): v_i along the lane.
    lane_mask (B, M); lane_id (B, M); lane_merging (B, M);
    lane_ego_distance_m (B, M): d_e,i, the ego to the zone's centre;
    lane_hidden_distance_m (B, M): d_o; lane_speed_limit_mps (B, M): v_o;
    lane_ego_zone_m (B, M) and lane_zone_m (B, M): the zone's length l along the ego's path
    and along the lane.
    """

    stop_line_distance_m: Floats
    goal_distance_m: Floats
    ego_speed_mps: Floats
    vehicle_mask: Booleans
    vehicle_id: Integers
    vehicle_lane: Integers
    vehicle_distance_m: Floats
    vehicle_speed_mps: Floats
    lane_mask: Booleans
    lane_id: Integers
    lane_merging: Booleans
    lane_ego_distance_m: Floats
    lane_hidden_distance_m: Floats
    lane_speed_limit_mps: Floats
    lane_ego_zone_m: Floats
    lane_zone_m: Floats


def empty_situations(batch: int, vehicles: int, lanes: int) -> Situations:
    """Return zeroed situations of shape (B, N) and (B, M) with nothing masked in."""

    def floats(*shape: int) -> Floats:
        return np.zeros(shape)

    def integers(*shape: int) -> Integers:
        return np.zeros(shape, dtype=np.int64)

    def booleans(*shape: int) -> Booleans:
        return np.zeros(shape, dtype=np.bool_)

    n, m = (batch, vehicles), (batch, lanes)
    return Situations(
        stop_line_distance_m=floats(batch),
        goal_distance_m=floats(batch),
        ego_speed_mps=floats(batch),
        vehicle_mask=booleans(*n),
        vehicle_id=integers(*n),
        vehicle_lane=integers(*n),
        vehicle_distance_m=floats(*n),
        vehicle_speed_mps=floats(*n),
        lane_mask=booleans(*m),
        lane_id=integers(*m),
        lane_merging=booleans(*m),
        lane_ego_distance_m=floats(*m),
        lane_hidden_distance_m=floats(*m),
        lane_speed_limit_mps=floats(*m),
        lane_ego_zone_m=floats(*m),
        lane_zone_m=floats(*m),
    )
