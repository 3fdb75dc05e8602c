# SPDX-License-Identifier: Apache-2.0
"""How other vehicles come and go, and where there is room for them."""

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.geometry.footprint import footprints_overlap
from risk_dqn_planner.situation.situations import Booleans, Floats
from sim_bridge.perception.visibility import cast_shadows, point_hidden
from sim_bridge.simulation.randomness import (
    VEHICLE_STREAM,
    random_between,
    random_index,
    random_share,
)
from sim_bridge.simulation.settings import Draws, Settings
from sim_bridge.simulation.state import (
    NOBODY,
    Episodes,
    Vehicles,
)
from sim_bridge.world.path_geometry import place_ahead, table_pose
from sim_bridge.world.sharing import Sharing
from sim_bridge.world.world import EgoLane, Lanes, Paths

_DRAWS_PER_VEHICLE = 4
# Between footprints, on whatever lanes.
_CLEARANCE_M = 0.5


@kernel
def has_room(
    b: int,
    i: int,
    p: int,
    s: float,
    desired_mps: float,
    settings: Settings,
    paths: Paths,
    sharing: Sharing,
    vehicles: Vehicles,
) -> bool:
    """Tell whether a vehicle may be put into place i of episode b, at s on path p.

    Behind the next one and ahead of the one behind there must be the standstill gap and the
    headway; nobody's footprint may come near, whatever lane it is on.
    """
    driving, path, s_m, speed_mps = (
        vehicles.driving,
        vehicles.path,
        vehicles.s_m,
        vehicles.speed_mps,
    )
    low_m, high_m, offset_m = sharing.low_m, sharing.high_m, sharing.offset_m
    touches, table = sharing.touches, paths.table
    length_m, width_m = paths.vehicle_length_m, paths.vehicle_width_m
    least_m, headway_s = length_m + settings.idm.standstill_gap_m, settings.draws.headway_s
    for j in range(driving.shape[1]):
        if j == i or not driving[b, j]:
            continue
        q, other = path[b, j], s_m[b, j]
        if low_m[p, q] <= other <= high_m[p, q]:
            ahead = other + offset_m[p, q] - s
            if 0.0 <= ahead < least_m + headway_s * desired_mps:
                return False
        if low_m[q, p] <= s <= high_m[q, p]:
            behind = s + offset_m[q, p] - other
            if 0.0 <= behind < least_m + headway_s * speed_mps[b, j]:
                return False
        if p != q and touches[p, q]:
            x1, y1, heading1 = table_pose(table, p, s)
            x2, y2, heading2 = table_pose(table, q, other)
            length, width = length_m + _CLEARANCE_M, width_m + _CLEARANCE_M
            if footprints_overlap(x1, y1, heading1, length, width, x2, y2, heading2, length, width):
                return False
    return True


@kernel
def wanted_speed(drawn_mps: float, limit_mps: float, draws: Draws) -> float:
    """Return how fast a driver wants to go: as drawn, but for the limit, which is overstepped."""
    return draws.overspeed_factor * min(drawn_mps, limit_mps)


@kernel
def draw_vehicle(
    seed: np.uint64, number: int, draws: Draws, lanes: Lanes, limit_mps: Floats
) -> tuple[int, float, bool]:
    """Return path, desired speed and whether it yields, of the vehicle with an id.

    All depends on seed and id alone. limit_mps (P,): of the paths.
    """
    draw = number * _DRAWS_PER_VEHICLE
    first_entry = lanes.first_entry
    # A lane first, so that lanes with many ways in do not have more traffic than others.
    lane = random_index(seed, VEHICLE_STREAM, draw, len(first_entry) - 1)
    first, behind = first_entry[lane], first_entry[lane + 1]
    way = random_index(seed, VEHICLE_STREAM, draw + 1, behind - first)
    path = lanes.entry_path[first + way]
    low, high = draws.desired_speed_mps
    drawn = random_between(seed, VEHICLE_STREAM, draw + 2, low, high)
    share = random_share(seed, VEHICLE_STREAM, draw + 3)
    desired = wanted_speed(drawn, limit_mps[path], draws)
    return path, desired, share < draws.yielding_share


@kernel
def entry_in_sight(
    ego: EgoLane,
    paths: Paths,
    corners: Floats,
    settings: Settings,
    episodes: Episodes,
    b: int,
    p: int,
    shadows: Floats,
) -> bool:
    """Tell whether the ego sees where vehicles enter on path p.

    corners (2, K, 4, 2): catalogue of the obstacles; shadows (B, O, 4, 3): memory to work in.
    """
    x, y, _ = table_pose(paths.table, p, 0.0)
    ego_s_m, ahead_m = episodes.ego_s_m[b], settings.sensor_offset_m
    sensor_x, sensor_y = place_ahead(ego.table, 0, ego_s_m, ahead_m)
    count = cast_shadows(corners, episodes.obstacle, b, sensor_x, sensor_y, shadows, b)
    range_m = settings.sensor_range_m
    return not point_hidden(x, y, sensor_x, sensor_y, range_m, shadows, b, count)


@kernel
def replace_those_gone(
    paths: Paths, lanes: Lanes, draws: Draws, episodes: Episodes, vehicles: Vehicles
) -> None:
    """Where a decision is due, empty the places of vehicles that have left their path.

    With respawning traffic a new vehicle, with a new id, waits for each.
    """
    running, phase, seed, next_id = (
        episodes.running,
        episodes.phase,
        episodes.seed,
        episodes.next_id,
    )
    driving, waiting, path, s_m = vehicles.driving, vehicles.waiting, vehicles.path, vehicles.s_m
    ids, yields, follows_ego = vehicles.id, vehicles.yields, vehicles.follows_ego
    desired_mps, leader, leader_due = (
        vehicles.desired_speed_mps,
        vehicles.leader,
        vehicles.leader_due,
    )
    length_m, limit_mps = paths.length_m, paths.limit_mps
    batch, count = driving.shape
    for b in range(batch):
        if not running[b] or phase[b] != 0:
            continue
        for i in range(count):
            if not driving[b, i] or s_m[b, i] <= length_m[path[b, i]]:
                continue
            driving[b, i], waiting[b, i] = False, draws.respawn
            for j in range(count):
                leader_due[b, j] |= leader[b, j] == i
            path[b, i], desired_mps[b, i], yields[b, i] = draw_vehicle(
                seed[b], next_id[b], draws, lanes, limit_mps
            )
            ids[b, i], follows_ego[b, i] = next_id[b], False
            next_id[b] += 1


@kernel
def let_one_in(
    ego: EgoLane,
    paths: Paths,
    sharing: Sharing,
    corners: Floats,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
    shadows: Floats,
) -> None:
    """Where a decision is due, let one of the waiting vehicles in if there is room, in turn.

    Nobody appears out of nothing: an entry within the sensor's range must be out of sight.
    corners (2, K, 4, 2): the obstacles' catalogue; shadows (B, O, 4, 3): memory to work in.
    """
    running, phase, tick = episodes.running, episodes.phase, episodes.tick
    driving, waiting, path, s_m = vehicles.driving, vehicles.waiting, vehicles.path, vehicles.s_m
    speed_mps, desired_mps, due = (
        vehicles.speed_mps,
        vehicles.desired_speed_mps,
        vehicles.leader_due,
    )
    entry_is_far = paths.entry_is_far
    for b in range(len(running)):
        if not running[b] or phase[b] != 0:
            continue
        chosen = first_waiting(waiting, b, tick[b] // settings.decision_steps)
        if chosen == NOBODY:
            continue
        p, desired = path[b, chosen], desired_mps[b, chosen]
        if not entry_is_far[p] and entry_in_sight(
            ego, paths, corners, settings, episodes, b, p, shadows
        ):
            continue
        if has_room(b, chosen, p, 0.0, desired, settings, paths, sharing, vehicles):
            driving[b, chosen], waiting[b, chosen], due[b, chosen] = True, False, True
            s_m[b, chosen], speed_mps[b, chosen] = 0.0, desired


@kernel
def first_waiting(waiting: Booleans, b: int, turn: int) -> int:
    """Return the first place of episode b that waits, beginning with whose turn it is; -1 none."""
    begin = turn % max(waiting.shape[1], 1)
    found = NOBODY
    for i in range(waiting.shape[1]):
        if waiting[b, i] and (found == NOBODY or found < begin <= i):
            found = i
    return found
