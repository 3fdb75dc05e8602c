# SPDX-License-Identifier: Apache-2.0
"""What the planner gets to know of simulated situations, and the truth beside it."""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations
from sim_bridge.perception.visibility import HALF_PLANES, cast_shadows, first_hidden, hide_points
from sim_bridge.simulation.randomness import NOISE_STREAM, random_normal
from sim_bridge.simulation.settings import Settings
from sim_bridge.simulation.state import MOST_IDS, Episodes, Vehicles
from sim_bridge.world.matches import Matches
from sim_bridge.world.path_geometry import place_ahead, table_pose
from sim_bridge.world.sight_lines import SightLines
from sim_bridge.world.world import EgoLane, Lanes


class View(NamedTuple):
    """Where B sensors are, what stands in their way, and what they see: overwritten at each look.

    x_m, y_m (B,). shadows (B, O, 4, 3), see `cast_shadow`; cast (B,): how many of O there are.
    seen (B, N): vehicles; measured_mps (B, N): their speeds, with the sensor's noise.
    """

    x_m: Floats
    y_m: Floats
    shadows: Floats
    cast: Integers
    seen: Booleans
    measured_mps: Floats


def empty_view(batch: int, vehicles: int, obstacles: int) -> View:
    """Return room for the views of a batch."""
    return View(
        x_m=np.zeros(batch),
        y_m=np.zeros(batch),
        shadows=np.zeros((batch, obstacles, HALF_PLANES, 3)),
        cast=np.zeros(batch, dtype=np.int64),
        seen=np.zeros((batch, vehicles), dtype=np.bool_),
        measured_mps=np.zeros((batch, vehicles)),
    )


@kernel
def look(ego: EgoLane, corners: Floats, offset_m: float, episodes: Episodes, view: View) -> None:
    """Place all sensors `offset_m` ahead of the egos and cast the shadows of their obstacles.

    corners (2, K, 4, 2): catalogue of the obstacles.
    """
    table, ego_s_m, obstacle = ego.table, episodes.ego_s_m, episodes.obstacle
    x_m, y_m, shadows, cast = view.x_m, view.y_m, view.shadows, view.cast
    for b in range(len(x_m)):
        x, y = place_ahead(table, 0, ego_s_m[b], offset_m)
        x_m[b], y_m[b] = x, y
        cast[b] = cast_shadows(corners, obstacle, b, x, y, shadows, b)


@kernel
def perceive_egos(
    ego: EgoLane, ego_zone_center_m: Floats, episodes: Episodes, situations: Situations
) -> None:
    """Fill what situations say about the egos; ego_zone_center_m (M,)."""
    ego_s_m, speed_mps = episodes.ego_s_m, episodes.ego_speed_mps
    stop_line_m, goal_m = ego.stop_line_m, ego.goal_m
    to_stop_line_m, to_goal_m = situations.stop_line_distance_m, situations.goal_distance_m
    to_zone_m, perceived_mps = situations.lane_ego_distance_m, situations.ego_speed_mps
    for b in range(len(ego_s_m)):
        s = ego_s_m[b]
        to_stop_line_m[b] = stop_line_m - s
        to_goal_m[b] = goal_m - s
        perceived_mps[b] = speed_mps[b]
        for lane in range(len(ego_zone_center_m)):
            to_zone_m[b, lane] = ego_zone_center_m[lane] - s


@kernel
def perceive_lanes(
    first_path: Integers, sight: SightLines, range_m: float, view: View, hidden_m: Floats
) -> None:
    """Fill how far each lane is seen (B, M); the paths of lane j begin at first_path[j]."""
    xy, distance_m, points = sight.xy, sight.distance_m, sight.points
    x_m, y_m, shadows, cast = view.x_m, view.y_m, view.shadows, view.cast
    for b in range(len(x_m)):
        x, y, count = x_m[b], y_m[b], cast[b]
        for lane in range(len(first_path) - 1):
            nearest = math.inf
            for p in range(first_path[lane], first_path[lane + 1]):
                hidden = first_hidden(
                    xy, distance_m, p, points[p], x, y, range_m, shadows, b, count
                )
                nearest = min(nearest, hidden)
            hidden_m[b, lane] = nearest


@kernel
def measured_speed(
    speed_mps: float, noise_mps: float, seed: np.uint64, tick: int, id_: int
) -> float:
    """Return a speed as perceived; the error depends on seed, inner step and id alone."""
    if noise_mps <= 0.0:
        return speed_mps
    return speed_mps + noise_mps * random_normal(seed, NOISE_STREAM, tick * MOST_IDS + id_)


@allocating_kernel
def see_vehicles(
    table: Floats,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
    view: View,
    seen: Booleans,
    measured_mps: Floats,
) -> None:
    """Fill which vehicles are seen (B, N), and their speeds as perceived; table as in Paths."""
    driving, path, s_m, speed_mps = (
        vehicles.driving,
        vehicles.path,
        vehicles.s_m,
        vehicles.speed_mps,
    )
    seed, tick, ids = episodes.seed, episodes.tick, vehicles.id
    x_m, y_m, shadows, cast = view.x_m, view.y_m, view.shadows, view.cast
    range_m, noise_mps = settings.sensor_range_m, settings.velocity_noise_mps
    count = driving.shape[1]
    x, y, depth = np.empty(count), np.empty(count), np.empty(count)
    for b in range(driving.shape[0]):
        # Empty places hold a path too, so that nothing need be asked here.
        for i in range(count):
            x[i], y[i], _ = table_pose(table, path[b, i], s_m[b, i])
        hide_points(x, y, x_m[b], y_m[b], range_m, shadows, b, cast[b], depth)
        for i in range(count):
            seen[b, i] = driving[b, i] & (depth[i] <= 0.0)
            if driving[b, i]:
                measured_mps[b, i] = measured_speed(
                    speed_mps[b, i], noise_mps, seed[b], tick[b], ids[b, i]
                )


@kernel
def match_vehicles(
    matches: Matches,
    path: Integers,
    s_m: Floats,
    ids: Integers,
    seen: Booleans,
    measured_mps: Floats,
    situations: Situations,
) -> None:
    """Fill in the seen vehicles, packed at the front, in the order of their places and lanes.

    path, s_m, ids, seen, measured_mps (B, N): as in Vehicles and View.
    """
    first, piece, lane = matches.first, matches.piece, matches.lane
    low_m, high_m, start_m, change = (
        matches.low_m,
        matches.high_m,
        matches.distance_m,
        matches.change,
    )
    share, share_change = matches.share, matches.share_change
    mask, found_id, found_lane = (
        situations.vehicle_mask,
        situations.vehicle_id,
        situations.vehicle_lane,
    )
    distance_m, along_mps = situations.vehicle_distance_m, situations.vehicle_speed_mps
    for b in range(seen.shape[0]):
        used = 0
        for i in range(seen.shape[1]):
            if not seen[b, i]:
                continue
            p, s = path[b, i], s_m[b, i]
            cell = min(max(int(s), 0), first.shape[1] - 2)
            for k in range(first[p, cell], first[p, cell + 1]):
                m = piece[k]
                along = s - low_m[m]
                if along < 0.0 or s >= high_m[m]:
                    continue
                mask[b, used] = True
                found_id[b, used] = ids[b, i]
                found_lane[b, used] = lane[m]
                distance_m[b, used] = start_m[m] + along * change[m]
                along_mps[b, used] = measured_mps[b, i] * (share[m] + along * share_change[m])
                used += 1
        for k in range(used, mask.shape[1]):
            mask[b, k] = False


@kernel
def perceive(
    ego: EgoLane,
    table: Floats,
    lanes: Lanes,
    matches: Matches,
    sight: SightLines,
    corners: Floats,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
    view: View,
    situations: Situations,
) -> None:
    """Fill the situations of all episodes; what describes the lanes for good must be there.

    table: of Paths; corners (2, K, 4, 2): catalogue of the obstacles.
    """
    look(ego, corners, settings.sensor_offset_m, episodes, view)
    perceive_egos(ego, lanes.ego_zone_center_m, episodes, situations)
    range_m, hidden_m = settings.sensor_range_m, situations.lane_hidden_distance_m
    perceive_lanes(lanes.first_path, sight, range_m, view, hidden_m)
    seen, measured_mps = view.seen, view.measured_mps
    see_vehicles(table, settings, episodes, vehicles, view, seen, measured_mps)
    path, s_m, ids = vehicles.path, vehicles.s_m, vehicles.id
    match_vehicles(matches, path, s_m, ids, seen, measured_mps, situations)
