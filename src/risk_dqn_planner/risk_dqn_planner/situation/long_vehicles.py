# SPDX-License-Identifier: Apache-2.0
"""Where vehicles that are longer than conflict zones are made for count.

A zone is made of two footprints of usual size. Of a longer vehicle the end that matters counts, as
if a vehicle of usual length were there: whatever is sound against that one is so against the longer
one. At a merging lane that is the rear of whoever the ego follows, and the front of whoever follows
the ego. Who is ahead but has not joined may turn out to be either: it counts by its rear, and its
front as a place where a hidden vehicle may be, before which the ego must join, or wait.
"""

import numpy as np

from risk_dqn_planner.intersection.model import ConflictKind, IntersectionModel
from risk_dqn_planner.situation.common_path import leader_gap
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers


def nearest_ends(
    model: IntersectionModel, ego_s: float, lane: Integers, distance_m: Floats, length_m: Floats
) -> Floats:
    """Return the distances (C,) to the zones' centres at which (vehicle, lane) pairs count [m].

    ego_s: the ego's arc length. lane (C,): index into the model's lanes. distance_m (C,): of the
    footprints' centres. length_m (C,): 0 where unknown, which is taken for the usual length.
    """
    more_m = longer_by(model, length_m)
    if not more_m.any():
        return distance_m
    zone_m = np.array([each.zone_length_m for each in model.lanes])[lane]
    ahead_m = ahead_of_ego(model, ego_s, lane, distance_m)
    # Of whom not even the front is far enough ahead to be followed, only the front matters.
    leads = ahead_m + more_m > least_lead(model)
    merging_m = np.where(leads, distance_m + np.minimum(ahead_m, more_m), distance_m - more_m)
    counts_m: Floats = np.where(
        merges(model)[lane], merging_m, before_or_past(distance_m, 0.5 * zone_m, more_m)
    )
    return counts_m


def fronts_to_join(
    model: IntersectionModel, ego_s: float, lane: Integers, distance_m: Floats, length_m: Floats
) -> Floats:
    """Return the distances (C,) of fronts that count as hidden vehicles; infinity elsewhere.

    Of longer vehicles at merging lanes that count by their rears, but have not left the zone with
    their fronts. Arguments as of `nearest_ends`; a front is that of a usual vehicle there.
    """
    more_m = longer_by(model, length_m)
    if not more_m.any():
        return np.full(len(lane), np.inf)
    front_m = distance_m - more_m
    end_m = np.array([-0.5 * each.zone_length_m for each in model.lanes])[lane]
    leads = ahead_of_ego(model, ego_s, lane, front_m) > least_lead(model)
    to_join = (more_m > 0.0) & merges(model)[lane] & leads & (front_m > end_m)
    return np.where(to_join, front_m, np.inf)


def longer_by(model: IntersectionModel, length_m: Floats) -> Floats:
    """Return by how much (C,) each end is further from the centre than that of a usual vehicle."""
    more_m: Floats = np.maximum(0.5 * (length_m - model.traffic_dimensions.length_m), 0.0)
    return more_m


def least_lead(model: IntersectionModel) -> float:
    """Return how far ahead (centre to centre) whoever the ego follows is at the very least [m]."""
    return min(model.ego_dimensions.length_m, model.traffic_dimensions.length_m)


def merges(model: IntersectionModel) -> Booleans:
    """Return which lanes (M,) merge."""
    return np.array([each.kind is ConflictKind.MERGING for each in model.lanes])


def ahead_of_ego(
    model: IntersectionModel, ego_s: float, lane: Integers, distance_m: Floats
) -> Floats:
    """Return how far (C,) vehicles are ahead of the ego on the path behind their joins."""
    zone_m = np.array([each.zone_length_m for each in model.lanes])[lane]
    ego_zone_m = np.array([each.ego_zone_length_m for each in model.lanes])[lane]
    ego_distance_m = np.array([each.ego_zone_center_m for each in model.lanes])[lane] - ego_s
    ahead_m: Floats = leader_gap(ego_distance_m, ego_zone_m, distance_m, zone_m)
    return ahead_m


def before_or_past(distance_m: Floats, half_zone_m: Floats, more_m: Floats) -> Floats:
    """Return where vehicles count at crossing zones: by the front before, by the rear past them.

    more_m: by how much they reach further from their centres to either end. The zone is longer for
    them by that at both ends; meanwhile those of usual length pass their own.
    """
    outside = np.abs(distance_m) > half_zone_m + more_m
    inside_m = distance_m * half_zone_m / (half_zone_m + more_m)
    nearer_m = np.sign(distance_m) * np.maximum(np.abs(distance_m) - more_m, 0.0)
    result: Floats = np.where(outside, nearer_m, inside_m)
    return result
