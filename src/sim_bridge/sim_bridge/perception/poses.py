# SPDX-License-Identifier: Apache-2.0
"""Where all vehicles are, seen or hidden, and where phantoms seem to be."""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers
from sim_bridge.perception.perception import View, look, see_vehicles
from sim_bridge.perception.phantoms import Reported, report_phantoms
from sim_bridge.simulation.settings import Sensing, Settings
from sim_bridge.simulation.state import Episodes, Vehicles
from sim_bridge.world.path_geometry import table_pose
from sim_bridge.world.world import EgoLane, Lanes, Paths


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


def empty_poses(batch: int, vehicles: int) -> VehiclePoses:
    """Return room for the poses of a batch; all masks are False."""
    shape = (batch, vehicles)
    return VehiclePoses(
        mask=np.zeros(shape, dtype=np.bool_),
        id=np.zeros(shape, dtype=np.int64),
        x_m=np.zeros(shape),
        y_m=np.zeros(shape),
        heading_rad=np.zeros(shape),
        speed_mps=np.zeros(shape),
        measured_speed_mps=np.zeros(shape),
        hidden=np.zeros(shape, dtype=np.bool_),
    )


@kernel
def reveal(
    ego: EgoLane,
    table: Floats,
    corners: Floats,
    settings: Settings,
    episodes: Episodes,
    vehicles: Vehicles,
    view: View,
    poses: VehiclePoses,
) -> None:
    """Fill the poses of all vehicles, and in the view which of them the ego sees.

    table: of Paths; corners (2, K, 4, 2): catalogue of the obstacles.
    """
    path, s_m = vehicles.path, vehicles.s_m
    x_m, y_m, heading_rad = poses.x_m, poses.y_m, poses.heading_rad
    look(ego, corners, settings.sensor_offset_m, episodes, view)
    see_vehicles(table, settings, episodes, vehicles, view, view.seen, view.measured_mps)
    for b in range(path.shape[0]):
        for i in range(path.shape[1]):
            x_m[b, i], y_m[b, i], heading_rad[b, i] = table_pose(table, path[b, i], s_m[b, i])


@kernel
def reveal_phantoms(
    ego: EgoLane,
    paths: Paths,
    lanes: Lanes,
    corners: Floats,
    settings: Settings,
    sensing: Sensing,
    episodes: Episodes,
    view: View,
    reported: Reported,
    poses: VehiclePoses,
) -> None:
    """Fill the poses (B, M) of the phantoms that the sensors report; corners as in `reveal`."""
    look(ego, corners, settings.sensor_offset_m, episodes, view)
    report_phantoms(paths, lanes, settings, sensing, episodes, view, reported)
    batch, count = poses.mask.shape
    first = reported.seen.shape[1] - count
    for b in range(batch):
        for lane in range(count):
            i = first + lane
            if reported.seen[b, i]:
                x, y, heading = table_pose(paths.table, reported.path[b, i], reported.s_m[b, i])
                poses.mask[b, lane], poses.id[b, lane] = True, reported.id[b, i]
                poses.x_m[b, lane], poses.y_m[b, lane] = x, y
                poses.heading_rad[b, lane] = heading
                poses.speed_mps[b, lane] = reported.measured_mps[b, i]
                poses.measured_speed_mps[b, lane] = reported.measured_mps[b, i]
