# SPDX-License-Identifier: Apache-2.0
"""Others that brake for an ego in their way, some time after they could first see it.

An ego is in a driver's way while it is inside of the conflict zone of the driver's lane, or
before it and at its present speed would be inside within a second. A driver sees it if no
obstacle stands between the ego's sensor and the middle of the driver's vehicle: so each sees the
other. Having seen it once a driver knows of it until it is out of the way, and after its time of
reaction brakes, as before a standing leader, for the beginning of its zone, never harder than the
stated limit. Who is in the zone already goes on.
"""

import math

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Floats
from sim_bridge.perception.visibility import cast_shadows, point_hidden
from sim_bridge.simulation.lags import UNNOTICED, Lags
from sim_bridge.simulation.settings import Reaction, Settings
from sim_bridge.simulation.state import SimulationState
from sim_bridge.simulation.traffic import idm_acceleration
from sim_bridge.world.path_geometry import place_ahead, table_pose
from sim_bridge.world.world import EgoLane, Lanes, Paths

_ABOUT_TO_ENTER_S = 1.0


@kernel
def in_the_way(ego_distance_m: float, half_ego_zone_m: float, ego_mps: float) -> bool:
    """Tell whether the ego, so far before a zone's centre, is inside or about to enter."""
    left = ego_distance_m <= -half_ego_zone_m
    return not left and ego_distance_m - half_ego_zone_m < ego_mps * _ABOUT_TO_ENTER_S


@kernel
def brake_for_egos(
    ego: EgoLane,
    paths: Paths,
    lanes: Lanes,
    corners: Floats,
    settings: Settings,
    lagging: tuple[Reaction, Lags],
    state: SimulationState,
    shadows: Floats,
) -> None:
    """Let drivers brake who have known of an ego in their way for long enough.

    corners (2, K, 4, 2): catalogue of the obstacles; shadows (B, O, 4, 3): memory to work in.
    """
    episodes, vehicles, (reaction, lags) = state.episodes, state.vehicles, lagging
    noticed = lags.noticed
    if noticed.shape[1] == 0:
        return
    s_m, speed_mps, path = vehicles.s_m, vehicles.speed_mps, vehicles.path
    desired_mps, acceleration_mps2 = vehicles.desired_speed_mps, vehicles.acceleration_mps2
    after_steps, hardest_mps2 = reaction.after_steps, reaction.braking_mps2
    batch, count = noticed.shape
    for b in range(batch):
        if not episodes.running[b]:
            continue
        ego_m, ego_mps = episodes.ego_s_m[b], episodes.ego_speed_mps[b]
        x, y = place_ahead(ego.table, 0, ego_m, settings.sensor_offset_m)
        cast = cast_shadows(corners, episodes.obstacle, b, x, y, shadows, b)
        for i in range(count):
            p = path[b, i]
            lane = paths.lane[p]
            gap_m = paths.enter_m[p] - s_m[b, i]
            to_zone_m, half_m = lanes.ego_zone_center_m[lane] - ego_m, 0.5 * lanes.ego_zone_m[lane]
            coming = vehicles.driving[b, i] and gap_m > 0.0
            if not (coming and in_the_way(to_zone_m, half_m, ego_mps)):
                noticed[b, i] = UNNOTICED
                continue
            if noticed[b, i] == UNNOTICED:
                px, py, _ = table_pose(paths.table, p, s_m[b, i])
                if point_hidden(px, py, x, y, math.inf, shadows, b, cast):
                    continue
            noticed[b, i] += 1
            if noticed[b, i] >= after_steps:
                wanted = idm_acceleration(
                    speed_mps[b, i], desired_mps[b, i], gap_m, 0.0, settings.idm
                )
                braking = max(wanted, -hardest_mps2)
                acceleration_mps2[b, i] = min(acceleration_mps2[b, i], braking)
