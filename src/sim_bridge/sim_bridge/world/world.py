# SPDX-License-Identifier: Apache-2.0
"""The fixed part of a simulation: an intersection model as arrays that kernels read.

Built once for a model, a scenario and a world seed. Arc lengths on a path count from where its
vehicles enter, which is not where the model's path begins (`shift_m`).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.errors import NoConflictError, ScenarioError
from risk_dqn_planner.intersection.model import ConflictKind, IntersectionModel
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers
from sim_bridge.scenarios.fields import Scenario
from sim_bridge.simulation.right_of_way import Crossings, crossings
from sim_bridge.world.contact import contact_intervals
from sim_bridge.world.matches import Matches, match_table
from sim_bridge.world.obstacles import Catalogue, obstacle_catalogue
from sim_bridge.world.path_geometry import SPACING_M, sampled
from sim_bridge.world.sharing import (
    EgoSharing,
    Sharing,
    TrafficLines,
    sharing,
    sharing_with_ego,
    traffic_lines,
)
from sim_bridge.world.sight_lines import SightLines, sight_lines

# Vehicles enter beyond what a sensor at the zone could see, and beyond where others start.
_OUT_OF_REACH_M = 5.0
_BEYOND_ZONE_M = 40.0
# The sampled lines go on beyond their ends, where vehicles wait for their replacement.
_BEYOND_M = 10.0


class EgoLane(NamedTuple):
    """The ego's path. table (1, K, 3): x, y, heading every SPACING_M.

    first_zone_m: where the first conflict zone begins. contact_low_m, contact_high_m: outside of
    these arc lengths the ego cannot touch any other vehicle.
    """

    table: Floats
    stop_line_m: float
    first_zone_m: float
    goal_m: float
    contact_low_m: float
    contact_high_m: float
    length_m: float
    width_m: float


class Paths(NamedTuple):
    """The P paths of other vehicles. table (P, K, 3): x, y, heading every SPACING_M.

    All others (P,). length_m: of the path; lane: index into M lanes; limit_mps; zone_m, enter_m,
    exit_m: the conflict zone's centre, beginning and end; shift_m: from arc length on the model's
    path to that used here; entry_is_far: vehicles enter beyond the sensor's range; contact_low_m,
    contact_high_m: outside of these a vehicle cannot touch the ego.
    """

    table: Floats
    length_m: Floats
    lane: Integers
    limit_mps: Floats
    zone_m: Floats
    enter_m: Floats
    exit_m: Floats
    shift_m: Floats
    entry_is_far: Booleans
    contact_low_m: Floats
    contact_high_m: Floats
    vehicle_length_m: float
    vehicle_width_m: float


class Lanes(NamedTuple):
    """The M intersecting lanes, all (M,), as in `IntersectingLane`.

    The paths of lane j are those from first_path[j] to first_path[j + 1] (exclusive), (M + 1,);
    new vehicles enter on entry_path[first_entry[j]] to entry_path[first_entry[j + 1]].
    """

    first_path: Integers
    first_entry: Integers
    entry_path: Integers
    id: Integers
    merging: Booleans
    limit_mps: Floats
    ego_zone_center_m: Floats
    ego_zone_m: Floats
    zone_m: Floats


class World(NamedTuple):
    """The fixed part of a simulation; paths are in the model's order of lanes and their paths."""

    ego: EgoLane
    paths: Paths
    lanes: Lanes
    sharing: Sharing
    crossings: Crossings
    ego_sharing: EgoSharing
    matches: Matches
    sight: SightLines
    obstacles: Catalogue


def build_world(
    model: IntersectionModel,
    scenario: Scenario,
    world_seed: int = 0,
    keep_out: Sequence[Floats] = (),
) -> World:
    """Lay a scenario out on an intersection; `keep_out` as in `obstacle_catalogue`.

    Raises:
        NoConflictError: the model has no intersecting lane.
        ScenarioError: the ego or obstacles do not fit.
    """
    if not model.lanes:
        raise NoConflictError(f"route {model.route} meets no intersecting lane to simulate")
    if model.stop_line.position_m < scenario.ego.distance_m.low:
        raise ScenarioError(
            f"scenario {scenario.name}: the ego starts {scenario.ego.distance_m} m before the stop "
            f"line, but its path begins only {model.stop_line.position_m:.1f} m before it"
        )
    lanes = [k for k, lane in enumerate(model.lanes) for _ in lane.paths]
    reach = max(scenario.sensor.range_m, scenario.traffic.start_distance_m.high)
    traffic = traffic_lines(model, reach + _OUT_OF_REACH_M, _BEYOND_ZONE_M)
    entries = np.flatnonzero(traffic.enters)
    ego, paths = _tables(model, lanes, traffic, scenario.sensor.range_m)
    shared = sharing(traffic.line, paths.table, model.traffic_dimensions)
    return World(
        ego=ego,
        paths=paths,
        lanes=Lanes(
            first_path=np.searchsorted(lanes, range(len(model.lanes) + 1)),
            first_entry=np.searchsorted(np.array(lanes)[entries], range(len(model.lanes) + 1)),
            entry_path=entries,
            id=np.array([lane.lane_id for lane in model.lanes], dtype=np.int64),
            merging=np.array([lane.kind == ConflictKind.MERGING for lane in model.lanes]),
            limit_mps=np.array([lane.speed_limit_mps for lane in model.lanes]),
            ego_zone_center_m=np.array([lane.ego_zone_center_m for lane in model.lanes]),
            ego_zone_m=np.array([lane.ego_zone_length_m for lane in model.lanes]),
            zone_m=np.array([lane.zone_length_m for lane in model.lanes]),
        ),
        sharing=shared,
        crossings=crossings(paths.table, shared.low_m < np.inf, model.traffic_dimensions),
        ego_sharing=sharing_with_ego(model, lanes, traffic),
        matches=match_table(model, paths.table, paths.length_m),
        sight=sight_lines(model, scenario.sensor.range_m),
        obstacles=obstacle_catalogue(model, scenario.obstacles, world_seed, keep_out),
    )


def _tables(
    model: IntersectionModel, lanes: list[int], traffic: TrafficLines, sensor_range_m: float
) -> tuple[EgoLane, Paths]:
    """Sample the ego's path and the lines of all others, whose lanes (P,) are given."""
    conflicts = [path for lane in model.lanes for path in lane.paths]
    lengths = np.array([line.length_m for line in traffic.line])
    count = int((lengths.max() + _BEYOND_M) / SPACING_M) + 2
    ego_line = model.ego_path.centerline
    ego_table = sampled(ego_line, int(ego_line.length_m / SPACING_M) + 2)
    table = np.array([sampled(line, count) for line in traffic.line])
    zone = np.array([path.zone_center_m for path in conflicts]) + traffic.shift_m
    lane_zone = np.array([model.lanes[k].zone_length_m for k in lanes])
    exit_m = zone + 0.5 * lane_zone
    starts = [lane.ego_zone_center_m - 0.5 * lane.ego_zone_length_m for lane in model.lanes]
    own, other = model.ego_dimensions, model.traffic_dimensions
    ego_contact, contact = contact_intervals(ego_table, table, own, other)
    ego = EgoLane(
        table=ego_table[None],
        stop_line_m=model.stop_line.position_m,
        first_zone_m=min(starts),
        goal_m=model.goal_m,
        contact_low_m=ego_contact[0],
        contact_high_m=ego_contact[1],
        length_m=own.length_m,
        width_m=own.width_m,
    )
    paths = Paths(
        table=table,
        length_m=lengths,
        lane=np.array(lanes, dtype=np.int64),
        limit_mps=np.array([model.lanes[k].speed_limit_mps for k in lanes]),
        zone_m=zone,
        enter_m=exit_m - lane_zone,
        exit_m=exit_m,
        shift_m=np.array(traffic.shift_m),
        entry_is_far=zone > sensor_range_m,
        contact_low_m=np.ascontiguousarray(contact[:, 0]),
        contact_high_m=np.ascontiguousarray(contact[:, 1]),
        vehicle_length_m=other.length_m,
        vehicle_width_m=other.width_m,
    )
    return ego, paths
