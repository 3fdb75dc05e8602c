# SPDX-License-Identifier: Apache-2.0
"""Where vehicles that are longer than conflict zones are made for count.

A zone is made of two footprints of usual size. Of a longer vehicle the nearer end counts, as if a
vehicle of usual length were there: whatever is sound against that one is so against the longer one.
"""

import numpy as np

from risk_dqn_planner.intersection.model import ConflictKind, IntersectionModel
from risk_dqn_planner.situation.common_path import leader_gap
from risk_dqn_planner.situation.situations import Floats, Integers


def nearest_ends(
    model: IntersectionModel, ego_s: float, lane: Integers, distance_m: Floats, length_m: Floats
) -> Floats:
    """Return the distances (C,) to the zones' centres at which (vehicle, lane) pairs count [m].

    ego_s: the ego's arc length. lane (C,): index into the model's lanes. distance_m (C,): of the
    footprints' centres. length_m (C,): 0 where unknown, which is taken for the usual length.
    """
    more_m = np.maximum(0.5 * (length_m - model.traffic_dimensions.length_m), 0.0)
    if not more_m.any():
        return distance_m
    zone_m = np.array([each.zone_length_m for each in model.lanes])[lane]
    ego_zone_m = np.array([each.ego_zone_length_m for each in model.lanes])[lane]
    ego_distance_m = np.array([each.ego_zone_center_m for each in model.lanes])[lane] - ego_s
    merging = np.array([each.kind is ConflictKind.MERGING for each in model.lanes])[lane]
    ahead_m = leader_gap(ego_distance_m, ego_zone_m, distance_m, zone_m)
    counts_m: Floats = np.where(
        merging,
        distance_m + ahead_m - shortened(ahead_m, more_m),
        before_or_past(distance_m, 0.5 * zone_m, more_m),
    )
    return counts_m


def before_or_past(distance_m: Floats, half_zone_m: Floats, more_m: Floats) -> Floats:
    """Return where vehicles count at crossing zones: by the front before, by the rear past them.

    more_m: by how much they reach further from their centres to either end. The zone is longer for
    them by that at both ends; meanwhile those of usual length pass their own.
    """
    outside = np.abs(distance_m) > half_zone_m + more_m
    inside_m = distance_m * half_zone_m / (half_zone_m + more_m)
    result: Floats = np.where(outside, shortened(distance_m, more_m), inside_m)
    return result


def shortened(way_m: Floats, by_m: Floats) -> Floats:
    """Return ways of either sign that are shorter by so much, down to 0.

    At merging lanes: from the ego to whoever is ahead, by its rear, or behind, by its front.
    """
    result: Floats = np.sign(way_m) * np.maximum(np.abs(way_m) - by_m, 0.0)
    return result
