# SPDX-License-Identifier: Apache-2.0
"""What the last five scenes held of vehicles and lanes: remember, select, recall (kernels).

Vehicles and lanes are alike here: an entry has a number (id of the vehicle, or of the lane), a
lane id, and three encoded values.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Floats, Integers, Situations
from risk_dqn_planner.state.encoding import (
    ROWS,
    SCENES,
    TAKEN,
    StateParameters,
    criticality,
    encode_distance,
    encode_speed,
)

States = NDArray[np.float32]

LEAST = np.iinfo(np.int64).min


class Track(NamedTuple):
    """What the last five scenes held of vehicles or of lanes, encoded.

    Rings over the scenes with room for P: entries (B, 5), how many there are; number (B, 5, P),
    id of the vehicle or of the lane; lane (B, 5, P), id of its lane; values (B, 5, P, 3).
    critical (B, P): c_i of the present scene's entries.
    """

    entries: Integers
    number: Integers
    lane: Integers
    values: States
    critical: Floats


# Fields of named tuples are taken out before the loops: reading them inside costs a count of
# references each time.


@kernel
def scene_before(head: int, k: int) -> int:
    """Return the place in the rings of the scene k before the present one."""
    return head - k if k <= head else head - k + SCENES


@kernel
def remember_lanes(
    s: Situations, p: StateParameters, head: int, track: Track, ego_distance: Floats
) -> None:
    """Remember all lanes at place `head` of the rings; fill `ego_distance` (B, M)."""
    mask, ids, limit_mps = s.lane_mask, s.lane_id, s.lane_speed_limit_mps
    ego_distance_m, hidden_distance_m = s.lane_ego_distance_m, s.lane_hidden_distance_m
    number, lane_id, values, critical = track.number, track.lane, track.values, track.critical
    entries = track.entries
    for row in range(mask.shape[0]):
        entry = 0
        for lane in range(mask.shape[1]):
            if not mask[row, lane]:
                continue
            ego = encode_distance(ego_distance_m[row, lane], p.ego_zone_max_m)
            hidden = encode_distance(hidden_distance_m[row, lane], p.hidden_max_m)
            ego_distance[row, lane] = ego
            critical[row, entry] = criticality(hidden, ego)
            number[row, head, entry] = lane_id[row, head, entry] = ids[row, lane]
            values[row, head, entry, 0] = hidden
            values[row, head, entry, 1] = encode_speed(limit_mps[row, lane], p.speed_max_mps)
            values[row, head, entry, 2] = ego
            entry += 1
        entries[row, head] = entry


@kernel
def remember_vehicles(
    s: Situations, p: StateParameters, head: int, track: Track, ego_distance: Floats
) -> None:
    """Remember all vehicles, once for each of their lanes; ego_distance (B, M), encoded."""
    mask, ids, lanes, lane_ids = s.vehicle_mask, s.vehicle_id, s.vehicle_lane, s.lane_id
    distance_m, speed_mps = s.vehicle_distance_m, s.vehicle_speed_mps
    number, lane_id, values, critical = track.number, track.lane, track.values, track.critical
    entries = track.entries
    for row in range(mask.shape[0]):
        entry = 0
        for vehicle in range(mask.shape[1]):
            if not mask[row, vehicle]:
                continue
            lane = lanes[row, vehicle]
            distance = encode_distance(distance_m[row, vehicle], p.vehicle_max_m)
            critical[row, entry] = criticality(distance, ego_distance[row, lane])
            number[row, head, entry] = ids[row, vehicle]
            lane_id[row, head, entry] = lane_ids[row, lane]
            values[row, head, entry, 0] = distance
            values[row, head, entry, 1] = encode_speed(speed_mps[row, vehicle], p.speed_max_mps)
            values[row, head, entry, 2] = ego_distance[row, lane]
            entry += 1
        entries[row, head] = entry


@kernel
def select(track: Track, head: int, chosen: Integers, count: Integers) -> None:
    """Choose the most critical entries (B, K) of the present scene, best first, `count` (B,) each.

    `critical` is used up. A number is chosen once, with its most critical entry; ties go by
    number, then lane, so that the order of entries does not matter.
    """
    entries, number, lane, critical = track.entries, track.number, track.lane, track.critical
    for row in range(len(entries)):
        used = 0
        while used < chosen.shape[1]:
            best, best_critical, best_number, best_lane = -1, TAKEN, LEAST, LEAST
            for entry in range(entries[row, head]):
                this, this_number = critical[row, entry], number[row, head, entry]
                this_lane = lane[row, head, entry]
                # Without branches, which a processor could not foresee.
                first = (this_number < best_number) | (
                    (this_number == best_number) & (this_lane < best_lane)
                )
                better = (this > best_critical) | ((this == best_critical) & first)
                best = entry if better else best
                best_critical = this if better else best_critical
                best_number = this_number if better else best_number
                best_lane = this_lane if better else best_lane
            if best < 0:
                break
            chosen[row, used] = best
            used += 1
            for entry in range(entries[row, head]):
                taken = number[row, head, entry] == best_number
                critical[row, entry] = TAKEN if taken else critical[row, entry]
        count[row] = used


@kernel
def recall(
    track: Track,
    head: int,
    known: Integers,
    chosen: Integers,
    count: Integers,
    column: int,
    out: States,
) -> None:
    """Fill columns of `out` (B, 5, 3, 8), from `column` on, with what `select` has chosen.

    Each entry brings its own values of the `known` (B,) last scenes; where it was absent, the next
    later one stands in. Missing entries are 1, 0, 1.
    """
    entries, number, lane, values = track.entries, track.number, track.lane, track.values
    slots = chosen.shape[1]
    for row in range(len(entries)):
        for slot in range(count[row]):
            then, place = head, chosen[row, slot]
            for k in range(SCENES):
                if 0 < k < known[row]:
                    earlier = scene_before(head, k)
                    found = find(
                        number,
                        lane,
                        row,
                        head,
                        chosen[row, slot],
                        earlier,
                        entries[row, earlier],
                        place,
                    )
                    if found >= 0:
                        then, place = earlier, found
                for i in range(ROWS):
                    out[row, k, i, column + slot] = values[row, then, place, i]
        for slot in range(count[row], slots):
            for k in range(SCENES):
                out[row, k, 0, column + slot] = 1.0
                out[row, k, 1, column + slot] = 0.0
                out[row, k, 2, column + slot] = 1.0


@kernel
def find(
    number: Integers,
    lane: Integers,
    row: int,
    head: int,
    entry: int,
    then: int,
    entries: int,
    place: int,
) -> int:
    """Return the place in an earlier scene of an entry of the present one, -1 if absent.

    It seldom changes its place from scene to scene, so `place` is looked at first.
    """
    wanted_number, wanted_lane = number[row, head, entry], lane[row, head, entry]
    if (
        place < entries
        and number[row, then, place] == wanted_number
        and lane[row, then, place] == wanted_lane
    ):
        return place
    for at in range(entries):
        if number[row, then, at] == wanted_number and lane[row, then, at] == wanted_lane:
            return at
    return -1
