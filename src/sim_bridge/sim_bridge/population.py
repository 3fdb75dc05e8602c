# SPDX-License-Identifier: Apache-2.0
"""Who is on the road: how an episode begins, and how vehicles come and go."""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers
from sim_bridge.path_geometry import table_pose
from sim_bridge.randomness import (
    COUNT_STREAM,
    EGO_STREAM,
    OBSTACLE_STREAM,
    PLACE_STREAM,
    VEHICLE_STREAM,
    random_between,
    random_index,
    random_share,
)
from sim_bridge.settings import Draws, Settings
from sim_bridge.sharing import Sharing
from sim_bridge.state import (
    NO_ACTION,
    NOBODY,
    Counts,
    Episodes,
    SimulationState,
    Vehicles,
)
from sim_bridge.visibility import HALF_PLANES, cast_shadows, point_hidden
from sim_bridge.world import EgoLane, Lanes, Paths

# How often a place is drawn for a vehicle before it is left to come in from upstream.
_ATTEMPTS = 30
_DRAWS_PER_VEHICLE = 4
# Beyond the footprints' reach, on whatever lane.
_CLEARANCE_M = 0.5


@kernel
def has_room(
    paths: Paths,
    sharing: Sharing,
    vehicles: Vehicles,
    b: int,
    i: int,
    s: float,
    standstill_gap_m: float,
    headway_s: float,
) -> bool:
    """Tell whether vehicle i may be placed at s on its path, moving at its desired speed.

    Behind the next one and ahead of the one behind there must be the standstill gap and the
    headway; nobody's footprint may come near, whatever lane it is on.
    """
    p = vehicles.path[b, i]
    x, y, _ = table_pose(paths.table, p, s)
    clearance = math.hypot(paths.vehicle_length_m, paths.vehicle_width_m) + _CLEARANCE_M
    least = paths.vehicle_length_m + standstill_gap_m
    for j in range(vehicles.driving.shape[1]):
        if j == i or not vehicles.driving[b, j]:
            continue
        q, other = vehicles.path[b, j], vehicles.s_m[b, j]
        other_x, other_y, _ = table_pose(paths.table, q, other)
        if math.hypot(other_x - x, other_y - y) < clearance:
            return False
        if sharing.low_m[p, q] <= other <= sharing.high_m[p, q]:
            ahead = other + sharing.offset_m[p, q] - s
            if 0.0 <= ahead < least + headway_s * vehicles.desired_speed_mps[b, i]:
                return False
        if sharing.low_m[q, p] <= s <= sharing.high_m[q, p]:
            behind = s + sharing.offset_m[q, p] - other
            if 0.0 <= behind < least + headway_s * vehicles.speed_mps[b, j]:
                return False
    return True


@kernel
def choose_vehicle(
    paths: Paths, lanes: Lanes, draws: Draws, episodes: Episodes, vehicles: Vehicles, b: int, i: int
) -> None:
    """Let a new vehicle, with a new id, wait in place i; all it is depends on its id alone."""
    seed = episodes.seed[b]
    number = episodes.next_id[b]
    episodes.next_id[b] += 1
    draw = number * _DRAWS_PER_VEHICLE
    # A lane first, so that lanes with many ways in do not have more traffic than others.
    lane = random_index(seed, VEHICLE_STREAM, draw, len(lanes.id))
    first, behind = lanes.first_entry[lane], lanes.first_entry[lane + 1]
    path = lanes.entry_path[first + random_index(seed, VEHICLE_STREAM, draw + 1, behind - first)]
    low, high = draws.desired_speed_mps
    desired = random_between(seed, VEHICLE_STREAM, draw + 2, low, high)
    share = random_share(seed, VEHICLE_STREAM, draw + 3)
    vehicles.id[b, i] = number
    vehicles.driving[b, i] = False
    vehicles.waiting[b, i] = True
    vehicles.path[b, i] = path
    vehicles.desired_speed_mps[b, i] = min(desired, paths.limit_mps[path])
    vehicles.yields[b, i] = share < draws.yielding_share
    vehicles.follows_ego[b, i] = False
    vehicles.leader[b, i] = NOBODY


@kernel
def place(
    paths: Paths,
    sharing: Sharing,
    vehicles: Vehicles,
    b: int,
    i: int,
    s: float,
    gap_m: float,
    headway_s: float,
) -> bool:
    """Let vehicle i drive from s on if there is room for it; tell whether it does."""
    if not has_room(paths, sharing, vehicles, b, i, s, gap_m, headway_s):
        return False
    vehicles.driving[b, i] = True
    vehicles.waiting[b, i] = False
    vehicles.s_m[b, i] = s
    vehicles.speed_mps[b, i] = vehicles.desired_speed_mps[b, i]
    return True


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

    corners (2, K, 4, 2): catalogue of the obstacles; shadows (1, O, 4, 3): memory to work in.
    """
    x, y, _ = table_pose(paths.table, p, 0.0)
    sensor_x, sensor_y, heading = table_pose(ego.table, 0, episodes.ego_s_m[b])
    sensor_x += settings.sensor_offset_m * math.cos(heading)
    sensor_y += settings.sensor_offset_m * math.sin(heading)
    count = cast_shadows(corners, episodes.obstacle, b, sensor_x, sensor_y, shadows, 0)
    range_m = settings.sensor_range_m
    return not point_hidden(x, y, sensor_x, sensor_y, range_m, shadows, 0, count)


@kernel
def come_and_go(
    ego: EgoLane,
    paths: Paths,
    lanes: Lanes,
    sharing: Sharing,
    corners: Floats,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
) -> None:
    """Where a decision is due, replace vehicles that have left and let waiting ones in.

    Nobody appears out of nothing: an entry within the sensor's range must be out of sight.
    Notes whether leaders have to be found anew. corners (2, K, 4, 2): the obstacles' catalogue.
    """
    driving, waiting, path, s_m = vehicles.driving, vehicles.waiting, vehicles.path, vehicles.s_m
    running, phase, leaders_due = episodes.running, episodes.phase, episodes.leaders_due
    length_m, entry_is_far = paths.length_m, paths.entry_is_far
    low_m, high_m = sharing.change_low_m, sharing.change_high_m
    draws, gap_m = settings.draws, settings.idm.standstill_gap_m
    shadows = np.empty((1, episodes.obstacle.shape[1], HALF_PLANES, 3))
    batch, count = driving.shape
    for b in range(batch):
        if not running[b] or phase[b] != 0:
            continue
        for i in range(count):
            p, s = path[b, i], s_m[b, i]
            leaders_due[b] |= (s >= low_m[p]) & (s <= high_m[p])
            if driving[b, i] and s > length_m[p]:
                driving[b, i] = False
                leaders_due[b] = True
                if draws.respawn:
                    choose_vehicle(paths, lanes, draws, episodes, vehicles, b, i)
            p = path[b, i]
            if not waiting[b, i] or (
                not entry_is_far[p]
                and entry_in_sight(ego, paths, corners, settings, episodes, b, p, shadows)
            ):
                continue
            leaders_due[b] |= place(paths, sharing, vehicles, b, i, 0.0, gap_m, draws.headway_s)


@kernel
def start_ego(stop_line_m: float, draws: Draws, episodes: Episodes, b: int) -> None:
    """Draw the ego's place and speed in episode b."""
    seed = episodes.seed[b]
    low, high = draws.ego_distance_m
    before = random_between(seed, EGO_STREAM, 0, low, min(high, stop_line_m))
    episodes.ego_s_m[b] = stop_line_m - before
    low, high = draws.ego_speed_mps
    episodes.ego_speed_mps[b] = random_between(seed, EGO_STREAM, 1, low, high)


@kernel
def start_traffic(
    paths: Paths,
    lanes: Lanes,
    sharing: Sharing,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
    b: int,
) -> None:
    """Draw the vehicles of episode b; who finds no place waits for one upstream."""
    seed, draws, gap_m = episodes.seed[b], settings.draws, settings.idm.standstill_gap_m
    low, high = draws.start_distance_m
    fewest, most = draws.vehicles
    count = fewest + random_index(seed, COUNT_STREAM, 0, most - fewest + 1)
    episodes.next_id[b] = 1
    for i in range(vehicles.driving.shape[1]):
        vehicles.driving[b, i] = False
        vehicles.waiting[b, i] = False
    for i in range(count):
        choose_vehicle(paths, lanes, draws, episodes, vehicles, b, i)
        center = paths.zone_m[vehicles.path[b, i]]
        for attempt in range(_ATTEMPTS):
            draw = vehicles.id[b, i] * _ATTEMPTS + attempt
            before = random_between(seed, PLACE_STREAM, draw, min(low, center), min(high, center))
            s = center - before
            if place(paths, sharing, vehicles, b, i, s, gap_m, draws.headway_s):
                break


@kernel
def start_counts(counts: Counts, episodes: Episodes, b: int) -> None:
    """Begin to count anew."""
    counts.start_s_m[b] = episodes.ego_s_m[b]
    counts.action_changes[b] = 0
    counts.last_action[b] = NO_ACTION
    counts.hard_brakes[b] = 0
    counts.least_time_gap_s[b] = math.inf
    for action in range(counts.action_counts.shape[1]):
        counts.action_counts[b, action] = 0
    for lane in range(counts.last_left_s.shape[1]):
        counts.last_left_s[b, lane] = -math.inf


@kernel
def start_episodes(
    stop_line_m: float,
    paths: Paths,
    lanes: Lanes,
    sharing: Sharing,
    obstacle_count: Integers,
    settings: Settings,
    state: SimulationState,
    seeds: NDArray[np.uint64],
    mask: Booleans,
) -> None:
    """Start the episodes that a mask (B,) names from their seeds (B,).

    obstacle_count (2,): how many placements the catalogue of each side holds.
    """
    episodes = state.episodes
    for b in range(len(seeds)):
        if not mask[b]:
            continue
        episodes.seed[b] = seeds[b]
        episodes.tick[b] = 0
        episodes.phase[b] = 0
        episodes.running[b] = True
        episodes.reached_goal[b] = False
        episodes.collided[b] = False
        episodes.timed_out[b] = False
        episodes.leaders_due[b] = True
        for o in range(episodes.obstacle.shape[1]):
            count = obstacle_count[o % 2]
            chosen = random_index(seeds[b], OBSTACLE_STREAM, o, max(count, 1))
            episodes.obstacle[b, o] = chosen if count > 0 else NOBODY
        start_ego(stop_line_m, settings.draws, episodes, b)
        start_traffic(paths, lanes, sharing, settings, episodes, state.vehicles, b)
        start_counts(state.counts, episodes, b)
