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


class Track(NamedTuple):
    """What the last five scenes held of vehicles or of lanes, encoded.

    Rings over the scenes with room for P: entries (B, 5), how many there are; number (B, 5, P),
    id of the vehicle or of the lane; lane (B, 5, P), id of its lane; values (B, 5, P, 3).
    """

    entries: Integers
    number: Integers
    lane: Integers
    values: States


@kernel
def remember_lanes(
    s: Situations,
    row: int,
    p: StateParameters,
    head: int,
    track: Track,
    ego_distance: Floats,
    critical: Floats,
) -> None:
    """Remember all lanes of a row; `ego_distance` (M,) and `critical` (entries,) are filled."""
    entry = 0
    for lane in range(s.lane_mask.shape[1]):
        if not s.lane_mask[row, lane]:
            continue
        ego_distance[lane] = encode_distance(s.lane_ego_distance_m[row, lane], p.ego_zone_max_m)
        hidden = encode_distance(s.lane_hidden_distance_m[row, lane], p.hidden_max_m)
        critical[entry] = criticality(hidden, ego_distance[lane])
        track.number[row, head, entry] = s.lane_id[row, lane]
        track.lane[row, head, entry] = s.lane_id[row, lane]
        track.values[row, head, entry, 0] = hidden
        track.values[row, head, entry, 1] = encode_speed(
            s.lane_speed_limit_mps[row, lane], p.speed_max_mps
        )
        track.values[row, head, entry, 2] = ego_distance[lane]
        entry += 1
    track.entries[row, head] = entry


@kernel
def remember_vehicles(
    s: Situations,
    row: int,
    p: StateParameters,
    head: int,
    track: Track,
    ego_distance: Floats,
    critical: Floats,
) -> None:
    """Remember all vehicles of a row, once for each of their lanes; fill `critical`."""
    entry = 0
    for vehicle in range(s.vehicle_mask.shape[1]):
        if not s.vehicle_mask[row, vehicle]:
            continue
        lane = s.vehicle_lane[row, vehicle]
        distance = encode_distance(s.vehicle_distance_m[row, vehicle], p.vehicle_max_m)
        critical[entry] = criticality(distance, ego_distance[lane])
        track.number[row, head, entry] = s.vehicle_id[row, vehicle]
        track.lane[row, head, entry] = s.lane_id[row, lane]
        track.values[row, head, entry, 0] = distance
        track.values[row, head, entry, 1] = encode_speed(
            s.vehicle_speed_mps[row, vehicle], p.speed_max_mps
        )
        track.values[row, head, entry, 2] = ego_distance[lane]
        entry += 1
    track.entries[row, head] = entry


@kernel
def select(track: Track, row: int, head: int, critical: Floats, slots: Integers) -> int:
    """Fill `slots` (K,) with the most critical entries; return how many there are.

    `critical` is used up. A number takes one slot, with its most critical entry; ties go by
    number, then lane, so that the order of entries does not matter.
    """
    count = track.entries[row, head]
    for slot in range(slots.shape[0]):
        best, best_critical = -1, 0.0
        for entry in range(count):
            if critical[entry] >= best_critical and (
                best < 0
                or critical[entry] > best_critical
                or track.number[row, head, entry] < track.number[row, head, best]
                or (
                    track.number[row, head, entry] == track.number[row, head, best]
                    and track.lane[row, head, entry] < track.lane[row, head, best]
                )
            ):
                best, best_critical = entry, critical[entry]
        if best < 0:
            return slot
        slots[slot] = best
        for entry in range(count):
            if track.number[row, head, entry] == track.number[row, head, best]:
                critical[entry] = TAKEN
    return int(slots.shape[0])


@kernel
def fill_slots(
    track: Track, row: int, head: int, slots: Integers, filled: int, column: int, out: States
) -> None:
    """Write the selected into the present scene, from `column` on; missing ones are 1, 0, 1."""
    for slot in range(slots.shape[0]):
        for i in range(ROWS):
            missing = 0.0 if i == 1 else 1.0
            out[row, 0, i, column + slot] = (
                track.values[row, head, slots[slot], i] if slot < filled else missing
            )


@kernel
def recall(
    track: Track,
    row: int,
    head: int,
    known: int,
    slots: Integers,
    filled: int,
    column: int,
    out: States,
) -> None:
    """Fill the earlier values of the selected, each its own, from `column` on."""
    for k in range(1, SCENES):
        then = (head - k) % SCENES
        for slot in range(slots.shape[0]):
            entry = -1
            if slot < filled and k < known:
                entry = find(track, row, then, head, slots[slot])
            for i in range(ROWS):
                out[row, k, i, column + slot] = (
                    track.values[row, then, entry, i]
                    if entry >= 0
                    else out[row, k - 1, i, column + slot]
                )


@kernel
def find(track: Track, row: int, then: int, head: int, entry: int) -> int:
    """Return the place in an earlier scene of an entry of the present one, -1 if absent."""
    number, lane = track.number[row, head, entry], track.lane[row, head, entry]
    count = track.entries[row, then]
    # It seldom changes its place from scene to scene: look there first.
    for i in range(-1, count):
        place = entry if i < 0 else i
        if (
            place < count
            and track.number[row, then, place] == number
            and track.lane[row, then, place] == lane
        ):
            return place
    return -1
