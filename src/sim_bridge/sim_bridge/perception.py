# SPDX-License-Identifier: Apache-2.0
"""What the planner gets to know of simulated situations, and the truth beside it."""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations
from sim_bridge.matches import Matches
from sim_bridge.path_geometry import table_pose
from sim_bridge.randomness import NOISE_STREAM, random_normal
from sim_bridge.settings import Settings
from sim_bridge.sight_lines import SightLines
from sim_bridge.state import NOBODY, Episodes, Vehicles
from sim_bridge.visibility import HALF_PLANES, cast_shadow, first_hidden, point_hidden
from sim_bridge.world import EgoLane, Lanes, Paths, World

# Errors of perceived speeds are numbered by inner step and vehicle id.
_MOST_IDS = 1 << 20


class View(NamedTuple):
    """Where B sensors are and what stands in their way.

    x_m, y_m (B,). shadows (B, O, 4, 3), see `cast_shadow`; cast (B,): how many of O there are.
    """

    x_m: Floats
    y_m: Floats
    shadows: Floats
    cast: Integers


class VehiclePoses(NamedTuple):
    """All vehicles of B episodes as they truly are; entries whose mask is False mean nothing.

    mask, id, x_m, y_m, heading_rad, speed_mps, hidden (B, N). measured_speed_mps (B, N): what a
    sensor with noise reports.
    """

    mask: Booleans
    id: Integers
    x_m: Floats
    y_m: Floats
    heading_rad: Floats
    speed_mps: Floats
    measured_speed_mps: Floats
    hidden: Booleans


def empty_view(batch: int, obstacles: int) -> View:
    """Return room for the views of a batch."""
    shadows = np.zeros((batch, obstacles, HALF_PLANES, 3))
    return View(np.zeros(batch), np.zeros(batch), shadows, np.zeros(batch, dtype=np.int64))


@kernel
def look(ego: EgoLane, corners: Floats, offset_m: float, episodes: Episodes, view: View) -> None:
    """Place all sensors `offset_m` ahead of the egos and cast the shadows of their obstacles.

    corners (2, K, 4, 2): catalogue of the obstacles.
    """
    obstacle = episodes.obstacle
    for b in range(len(view.x_m)):
        x, y, heading = table_pose(ego.table, 0, episodes.ego_s_m[b])
        x += offset_m * math.cos(heading)
        y += offset_m * math.sin(heading)
        count = 0
        for o in range(obstacle.shape[1]):
            if obstacle[b, o] != NOBODY:
                cast_shadow(corners[o % 2, obstacle[b, o]], x, y, view.shadows[b, count])
                count += 1
        view.x_m[b], view.y_m[b], view.cast[b] = x, y, count


@kernel
def perceive_ego_and_lanes(
    ego: EgoLane,
    lanes: Lanes,
    sight: SightLines,
    range_m: float,
    episodes: Episodes,
    view: View,
    situations: Situations,
) -> None:
    """Fill what situations say about the ego, and how far each lane is seen."""
    hidden_m, ego_distance_m = situations.lane_hidden_distance_m, situations.lane_ego_distance_m
    for b in range(len(view.x_m)):
        ego_s = episodes.ego_s_m[b]
        situations.stop_line_distance_m[b] = ego.stop_line_m - ego_s
        situations.goal_distance_m[b] = ego.goal_m - ego_s
        situations.ego_speed_mps[b] = episodes.ego_speed_mps[b]
        x, y, count = view.x_m[b], view.y_m[b], view.cast[b]
        for lane in range(len(lanes.id)):
            ego_distance_m[b, lane] = lanes.ego_zone_center_m[lane] - ego_s
            nearest = math.inf
            for p in range(lanes.first_path[lane], lanes.first_path[lane + 1]):
                hidden = first_hidden(
                    sight.xy,
                    sight.distance_m,
                    p,
                    sight.points[p],
                    x,
                    y,
                    range_m,
                    view.shadows,
                    b,
                    count,
                )
                nearest = min(nearest, hidden)
            hidden_m[b, lane] = nearest


@kernel
def measured_speed(
    speed_mps: float, noise_mps: float, seed: np.uint64, tick: int, id_: int
) -> float:
    """Return a speed as perceived; the error is the same however often one asks."""
    if noise_mps <= 0.0:
        return speed_mps
    return speed_mps + noise_mps * random_normal(seed, NOISE_STREAM, tick * _MOST_IDS + id_)


@kernel
def perceive_vehicles(
    paths: Paths,
    matches: Matches,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
    view: View,
    situations: Situations,
) -> None:
    """Fill in the seen vehicles, packed at the front, in the order of their places."""
    driving, path, s_m = vehicles.driving, vehicles.path, vehicles.s_m
    low_m, high_m = matches.low_m, matches.high_m
    mask, distance_m = situations.vehicle_mask, situations.vehicle_distance_m
    for b in range(len(view.x_m)):
        used = 0
        for i in range(driving.shape[1]):
            if not driving[b, i]:
                continue
            p, s = path[b, i], s_m[b, i]
            x, y, _ = table_pose(paths.table, p, s)
            if point_hidden(
                x,
                y,
                view.x_m[b],
                view.y_m[b],
                settings.sensor_range_m,
                view.shadows,
                b,
                view.cast[b],
            ):
                continue
            speed = measured_speed(
                vehicles.speed_mps[b, i],
                settings.velocity_noise_mps,
                episodes.seed[b],
                episodes.tick[b],
                vehicles.id[b, i],
            )
            cell = min(max(int(s), 0), matches.first.shape[1] - 2)
            for k in range(matches.first[p, cell], matches.first[p, cell + 1]):
                m = matches.piece[k]
                along = s - low_m[m]
                if along < 0.0 or s >= high_m[m]:
                    continue
                mask[b, used] = True
                situations.vehicle_id[b, used] = vehicles.id[b, i]
                situations.vehicle_lane[b, used] = matches.lane[m]
                distance_m[b, used] = matches.distance_m[m] + along * matches.change[m]
                share = matches.share[m] + along * matches.share_change[m]
                situations.vehicle_speed_mps[b, used] = speed * share
                used += 1
        for k in range(used, mask.shape[1]):
            mask[b, k] = False


@kernel
def perceive(
    world: World,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
    view: View,
    situations: Situations,
) -> None:
    """Fill the situations of all episodes; what describes the lanes for good must be there."""
    look(world.ego, world.obstacles.corners, settings.sensor_offset_m, episodes, view)
    perceive_ego_and_lanes(
        world.ego, world.lanes, world.sight, settings.sensor_range_m, episodes, view, situations
    )
    perceive_vehicles(world.paths, world.matches, settings, episodes, vehicles, view, situations)


@kernel
def reveal(
    world: World,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
    view: View,
    poses: VehiclePoses,
) -> None:
    """Fill the truth about all vehicles, and whether the ego sees them."""
    look(world.ego, world.obstacles.corners, settings.sensor_offset_m, episodes, view)
    for b in range(len(view.x_m)):
        for i in range(vehicles.path.shape[1]):
            poses.mask[b, i] = vehicles.driving[b, i]
            x, y, heading = table_pose(world.paths.table, vehicles.path[b, i], vehicles.s_m[b, i])
            poses.x_m[b, i], poses.y_m[b, i], poses.heading_rad[b, i] = x, y, heading
            poses.id[b, i] = vehicles.id[b, i]
            poses.speed_mps[b, i] = vehicles.speed_mps[b, i]
            poses.measured_speed_mps[b, i] = measured_speed(
                vehicles.speed_mps[b, i],
                settings.velocity_noise_mps,
                episodes.seed[b],
                episodes.tick[b],
                vehicles.id[b, i],
            )
            poses.hidden[b, i] = point_hidden(
                x,
                y,
                view.x_m[b],
                view.y_m[b],
                settings.sensor_range_m,
                view.shadows,
                b,
                view.cast[b],
            )
