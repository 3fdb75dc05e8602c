# SPDX-License-Identifier: Apache-2.0
"""A simulated moment as pictures need it."""

import numpy as np

from risk_dqn_planner.policies.base import Action
from sim_bridge.rendering.frames import Frame, VehicleFrame
from sim_bridge.simulation.simulation import Simulation

EGO_ID = 0


def snapshot(simulation: Simulation, episode: int, action: Action | None) -> Frame:
    """Return an episode as it stands; `action` is the decision in force."""
    poses = simulation.vehicle_poses()
    dimensions = simulation.model.traffic_dimensions
    ego = simulation.model.ego_dimensions
    x, y, heading, speed = simulation.ego_poses()[episode]
    return Frame(
        time_s=float(simulation.statistics().duration_s[episode]),
        ego=VehicleFrame(EGO_ID, x, y, heading, speed, ego.length_m, ego.width_m),
        action=action,
        vehicles=tuple(
            VehicleFrame(
                id=int(poses.id[episode, k]),
                x_m=float(poses.x_m[episode, k]),
                y_m=float(poses.y_m[episode, k]),
                heading_rad=float(poses.heading_rad[episode, k]),
                speed_mps=float(poses.speed_mps[episode, k]),
                length_m=dimensions.length_m,
                width_m=dimensions.width_m,
                hidden=bool(poses.hidden[episode, k]),
            )
            for k in np.flatnonzero(poses.mask[episode])
        ),
        obstacles=tuple(simulation.obstacles(episode)),
        visible_area=simulation.visible_area(episode),
    )
