# SPDX-License-Identifier: Apache-2.0
"""Vehicles that do not exist, but are reported: phantom detections.

In every second and for every intersecting lane there is one with the scenario's `phantom_share`
as its probability: somewhere on a path of the lane, no further before the zone than the sensor
reaches, driving on at a constant speed such as others want to drive. It is reported while the
place where it would be is seen, and has an id that no vehicle has. All depends on the seed, the
second and the lane alone.
"""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers
from sim_bridge.perception.perception import View
from sim_bridge.perception.visibility import point_hidden
from sim_bridge.simulation.population import wanted_speed
from sim_bridge.simulation.randomness import (
    PHANTOM_STREAM,
    random_between,
    random_index,
    random_share,
)
from sim_bridge.simulation.settings import Sensing, Settings
from sim_bridge.simulation.state import MOST_IDS, Episodes, Vehicles
from sim_bridge.world.path_geometry import table_pose
from sim_bridge.world.world import Lanes, Paths

_DRAWS_PER_PHANTOM = 4


class Reported(NamedTuple):
    """What a sensor reports, all (B, N + M): N vehicles, then a phantom of each of M lanes.

    As in Vehicles and View; M is 0 where there are no phantoms, and nothing is written then.
    """

    id: Integers
    path: Integers
    s_m: Floats
    seen: Booleans
    measured_mps: Floats


def empty_reported(batch: int, vehicles: int, lanes: int) -> Reported:
    """Return room for what a batch reports."""
    shape = (batch, vehicles + lanes)
    return Reported(
        id=np.zeros(shape, dtype=np.int64),
        path=np.zeros(shape, dtype=np.int64),
        s_m=np.zeros(shape),
        seen=np.zeros(shape, dtype=np.bool_),
        measured_mps=np.zeros(shape),
    )


@allocating_kernel
def report_vehicles(vehicles: Vehicles, view: View, reported: Reported) -> None:
    """Take over the vehicles, which of them are seen and how fast they look."""
    seen, measured_mps = view.seen, view.measured_mps
    count = seen.shape[1]
    reported.id[:, :count] = vehicles.id
    reported.path[:, :count] = vehicles.path
    reported.s_m[:, :count] = vehicles.s_m
    reported.seen[:, :count] = seen
    reported.measured_mps[:, :count] = measured_mps


@kernel
def report_phantoms(
    paths: Paths,
    lanes: Lanes,
    settings: Settings,
    sensing: Sensing,
    episodes: Episodes,
    view: View,
    reported: Reported,
) -> None:
    """Fill the places behind the vehicles with the present phantoms; the view is of the present."""
    sensor_x_m, sensor_y_m, shadows, cast = view.x_m, view.y_m, view.shadows, view.cast
    first_path, zone_m, exit_m = lanes.first_path, paths.zone_m, paths.exit_m
    range_m, lasts = settings.sensor_range_m, sensing.phantom_steps
    slowest_mps, fastest_mps = settings.draws.desired_speed_mps
    count = len(first_path) - 1
    first = reported.seen.shape[1] - count
    for b in range(reported.seen.shape[0]):
        seed, second = episodes.seed[b], episodes.tick[b] // lasts
        since_s = (episodes.tick[b] - second * lasts) * settings.step_s
        for lane in range(count):
            number, i = second * count + lane, first + lane
            draw = number * _DRAWS_PER_PHANTOM
            reported.seen[b, i] = False
            if random_share(seed, PHANTOM_STREAM, draw) >= sensing.phantom_share:
                continue
            ways = first_path[lane + 1] - first_path[lane]
            p = first_path[lane] + random_index(seed, PHANTOM_STREAM, draw + 1, ways)
            low_m = max(zone_m[p] - range_m, 0.0)
            begin_m = random_between(seed, PHANTOM_STREAM, draw + 2, low_m, exit_m[p])
            drawn = random_between(seed, PHANTOM_STREAM, draw + 3, slowest_mps, fastest_mps)
            mps = wanted_speed(drawn, paths.limit_mps[p], settings.draws)
            s = begin_m + mps * since_s
            x, y, _ = table_pose(paths.table, p, s)
            reported.id[b, i] = MOST_IDS + number
            reported.path[b, i], reported.s_m[b, i] = p, s
            reported.measured_mps[b, i] = mps
            reported.seen[b, i] = not point_hidden(
                x, y, sensor_x_m[b], sensor_y_m[b], range_m, shadows, b, cast[b]
            )
