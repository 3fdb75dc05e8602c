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
    COLUMNS,
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
    entries, number, lane = track.entries, track.number, track.lane
    batch, room = number.shape[0], number.shape[2]
    # One dimension for all within a row: a place is found by fewer products.
    values = track.values.reshape((batch, SCENES * room * ROWS))
    cells = out.reshape((batch, SCENES * ROWS * COLUMNS))
    for row in range(batch):
        for slot in range(count[row]):
            place = chosen[row, slot]
            wanted, wanted_lane = number[row, head, place], lane[row, head, place]
            at = (head * room + place) * ROWS
            distance, speed, ego = values[row, at], values[row, at + 1], values[row, at + 2]
            for k in range(SCENES):
                if 0 < k < known[row]:
                    then = scene_before(head, k)
                    found = find(
                        number, lane, row, then, entries[row, then], wanted, wanted_lane, place
                    )
                    if found >= 0:
                        place, at = found, (then * room + found) * ROWS
                        distance, speed = values[row, at], values[row, at + 1]
                        ego = values[row, at + 2]
                cell = k * ROWS * COLUMNS + column + slot
                cells[row, cell], cells[row, cell + COLUMNS] = distance, speed
                cells[row, cell + 2 * COLUMNS] = ego
        for slot in range(count[row], chosen.shape[1]):
            for k in range(SCENES):
                cell = k * ROWS * COLUMNS + column + slot
                cells[row, cell], cells[row, cell + COLUMNS] = 1.0, 0.0
                cells[row, cell + 2 * COLUMNS] = 1.0


@kernel
def find(
    number: Integers,
    lane: Integers,
    row: int,
    then: int,
    entries: int,
    wanted: int,
    wanted_lane: int,
    place: int,
) -> int:
    """Return the place of a number on a lane among the entries of an earlier scene, -1 if absent.

    It seldom changes its place from scene to scene, so `place` is looked at first.
    """
    if (
        place < entries
        and number[row, then, place] == wanted
        and lane[row, then, place] == wanted_lane
    ):
        return place
    for at in range(entries):
        if number[row, then, at] == wanted and lane[row, then, at] == wanted_lane:
            return at
    return -1
