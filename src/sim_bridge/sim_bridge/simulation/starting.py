# SPDX-License-Identifier: Apache-2.0
"""How episodes begin: everything that is drawn at random from a seed."""

import math

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Booleans, Integers
from sim_bridge.simulation.population import draw_vehicle, has_room
from sim_bridge.simulation.randomness import (
    COUNT_STREAM,
    EGO_STREAM,
    OBSTACLE_STREAM,
    PLACE_STREAM,
    random_between,
    random_index,
)
from sim_bridge.simulation.settings import Draws, Settings
from sim_bridge.simulation.state import (
    NO_ACTION,
    NOBODY,
    Counts,
    Episodes,
    SimulationState,
    Vehicles,
)
from sim_bridge.world.sharing import Sharing
from sim_bridge.world.world import Lanes, Paths

# How often a place is drawn for a vehicle before it is left to come in from upstream.
_ATTEMPTS = 12
# Numbers within a stream.
_PLACE, _SPEED = np.int64(0), np.int64(1)


@kernel
def start_egos(
    stop_line_m: float, draws: Draws, episodes: Episodes, counts: Counts, mask: Booleans
) -> None:
    """Draw the places and speeds of the egos that a mask (B,) names, and count anew."""
    for b in range(len(mask)):
        if not mask[b]:
            continue
        seed = episodes.seed[b]
        low, high = draws.ego_distance_m
        before = random_between(seed, EGO_STREAM, _PLACE, low, min(high, stop_line_m))
        episodes.ego_s_m[b] = counts.start_s_m[b] = stop_line_m - before
        low, high = draws.ego_speed_mps
        episodes.ego_speed_mps[b] = random_between(seed, EGO_STREAM, _SPEED, low, high)
        counts.action_changes[b] = 0
        counts.last_action[b] = NO_ACTION
        counts.hard_brakes[b] = 0
        counts.least_time_gap_s[b] = math.inf
        for action in range(counts.action_counts.shape[1]):
            counts.action_counts[b, action] = 0
        for lane in range(counts.last_left_s.shape[1]):
            counts.last_left_s[b, lane] = -math.inf


@kernel
def start_traffic(
    paths: Paths,
    lanes: Lanes,
    sharing: Sharing,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
    mask: Booleans,
) -> None:
    """Draw the vehicles of episodes; who finds no place waits for one upstream."""
    driving, waiting, path, s_m = vehicles.driving, vehicles.waiting, vehicles.path, vehicles.s_m
    speed_mps, desired_mps = vehicles.speed_mps, vehicles.desired_speed_mps
    seeds, next_id = episodes.seed, episodes.next_id
    ids, yields, follows_ego = vehicles.id, vehicles.yields, vehicles.follows_ego
    leader_due = vehicles.leader_due
    zone_m, limit_mps = paths.zone_m, paths.limit_mps
    draws = settings.draws
    nearest_m, furthest_m = draws.start_distance_m
    fewest, most = draws.vehicles
    for b in range(len(mask)):
        if not mask[b]:
            continue
        seed = seeds[b]
        count = fewest + random_index(seed, COUNT_STREAM, _PLACE, most - fewest + 1)
        next_id[b] = count + 1
        for i in range(driving.shape[1]):
            driving[b, i], waiting[b, i], leader_due[b, i] = False, i < count, True
        for i in range(count):
            p, desired, yields[b, i] = draw_vehicle(seed, i + 1, draws, lanes, limit_mps)
            ids[b, i], follows_ego[b, i], path[b, i] = i + 1, False, p
            speed_mps[b, i] = desired_mps[b, i] = desired
            low, high = min(nearest_m, zone_m[p]), min(furthest_m, zone_m[p])
            for attempt in range(_ATTEMPTS):
                draw = (i + 1) * _ATTEMPTS + attempt
                s = zone_m[p] - random_between(seed, PLACE_STREAM, draw, low, high)
                if has_room(b, i, p, s, desired, settings, paths, sharing, vehicles):
                    driving[b, i], waiting[b, i], s_m[b, i] = True, False, s
                    break


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
        for o in range(episodes.obstacle.shape[1]):
            count = obstacle_count[o % 2]
            chosen = random_index(seeds[b], OBSTACLE_STREAM, o, max(count, 1))
            episodes.obstacle[b, o] = chosen if count > 0 else NOBODY
    start_egos(stop_line_m, settings.draws, episodes, state.counts, mask)
    start_traffic(paths, lanes, sharing, settings, episodes, state.vehicles, mask)
