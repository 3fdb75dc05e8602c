# SPDX-License-Identifier: Apache-2.0
"""Builds the intersection model of an ego route from a Lanelet2 map."""

from collections.abc import Sequence

from risk_dqn_planner.errors import NoConflictError
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.intersection.conflicts import Conflict, find_conflicts
from risk_dqn_planner.intersection.ego_route import EgoRoute, ego_route
from risk_dqn_planner.intersection.model import (
    ConflictKind,
    ConflictPath,
    IntersectingLane,
    IntersectionModel,
)
from risk_dqn_planner.intersection.speed_limit import highest_speed_limit
from risk_dqn_planner.intersection.stop_line import find_stop_line
from risk_dqn_planner.intersection.ways import lane_path
from risk_dqn_planner.map.loader import RoadMap


def build_intersection(
    road_map: RoadMap,
    route: Sequence[int],
    config: IntersectionConfig | None = None,
) -> IntersectionModel:
    """Build the model of the intersections that a route of lanelet ids crosses.

    Raises:
        RouteError: the route is empty, unknown, disconnected or closed to vehicles.
        NoConflictError: no lane conflicts with the route.
    """
    config = config or IntersectionConfig()
    ego = ego_route(road_map, route, config)
    conflicts = find_conflicts(road_map, ego, config)
    if not conflicts:
        names = " > ".join(map(str, route))
        raise NoConflictError(f"no lane of {road_map.path} conflicts with the route {names}")
    notes = list(road_map.notes)
    notes.extend(
        f"lanelet {lanelet.id} of the route is open both ways; oncoming traffic on it is "
        "not part of the model"
        for lanelet in ego.route_lanelets
        if road_map.drivable(lanelet.invert())
    )
    lanes = _lanes(road_map, conflicts, config, notes)
    first_zone = min((conflict.ego for conflict in conflicts), key=lambda zone: zone.start)
    stop_line, stop_notes = find_stop_line(road_map, ego, first_zone, config)
    notes.extend(stop_notes)
    goal_m = _goal_m(ego, max(conflict.ego.end for conflict in conflicts), config, notes)
    leaders_until_m = goal_m + config.leaders_beyond_goal_m
    notes.extend(_leaders_out_of_map(ego, lanes, goal_m, leaders_until_m))
    return IntersectionModel(
        route=tuple(route),
        ego_path=lane_path(ego.chain),
        lanes=lanes,
        stop_line=stop_line,
        goal_m=goal_m,
        leaders_until_m=leaders_until_m,
        ego_dimensions=config.ego_dimensions,
        traffic_dimensions=config.traffic_dimensions,
        notes=tuple(dict.fromkeys(notes)),
    )


def _lanes(
    road_map: RoadMap,
    conflicts: Sequence[Conflict],
    config: IntersectionConfig,
    notes: list[str],
) -> tuple[IntersectingLane, ...]:
    """Return the lanes in the order (ego_zone_center_m, lane_id)."""
    taken: set[int] = set()
    lanes = []
    for conflict in conflicts:
        lane_id = _free_id(road_map, int(conflict.terminal.id), taken)
        taken.add(lane_id)
        lanes.append(_lane(conflict, lane_id, config, notes))
    return tuple(sorted(lanes, key=lambda lane: (lane.ego_zone_center_m, lane.lane_id)))


def _free_id(road_map: RoadMap, lanelet_id: int, taken: set[int]) -> int:
    """Return the terminal's id, or for its second zone the next one that nothing else has.

    A lanelet can touch the ego's corridor twice, as when it crosses the path and later merges
    into it; the zone that the ego meets first keeps the lanelet's id.
    """
    lane_id = lanelet_id
    while lane_id in taken or (
        lane_id != lanelet_id and road_map.lanelet_map.laneletLayer.exists(lane_id)
    ):
        lane_id += 1
    return lane_id


def _lane(
    conflict: Conflict, lane_id: int, config: IntersectionConfig, notes: list[str]
) -> IntersectingLane:
    upstream = {int(lanelet.id): lanelet for way in conflict.ways for lanelet in way.upstream}
    limit, limit_notes = highest_speed_limit(upstream.values())
    notes.extend(limit_notes)
    if limit is None:
        limit = config.default_speed_limit_mps
        notes.append(f"the map has no speed limit for lane {lane_id}, {limit:g} m/s is assumed")
    merging = conflict.kind is ConflictKind.MERGING
    return IntersectingLane(
        lane_id=lane_id,
        kind=conflict.kind,
        speed_limit_mps=limit,
        ego_zone_center_m=conflict.ego.center,
        ego_zone_length_m=conflict.ego.length,
        zone_length_m=conflict.own.length,
        ego_join_m=conflict.ego.end if merging else float("inf"),
        paths=tuple(
            ConflictPath(
                path=way.lane_path(),
                zone_center_m=way.end_m + conflict.own.center,
                join_m=way.end_m + conflict.own.end if merging else float("inf"),
            )
            for way in conflict.ways
        ),
    )


def _goal_m(
    ego: EgoRoute, last_zone_end_m: float, config: IntersectionConfig, notes: list[str]
) -> float:
    goal_m = last_zone_end_m + config.goal_beyond_m
    length_m = ego.chain.centerline.length_m
    if goal_m > length_m:
        notes.append(
            f"the map ends {length_m - last_zone_end_m:.1f} m past the last conflict zone, "
            f"so the goal lies there instead of {config.goal_beyond_m:g} m past it"
        )
        return length_m
    return goal_m


def _leaders_out_of_map(
    ego: EgoRoute, lanes: Sequence[IntersectingLane], goal_m: float, leaders_until_m: float
) -> list[str]:
    """Return what to say if vehicles that have merged leave the map while they still matter."""
    length_m = ego.chain.centerline.length_m
    merging = any(lane.kind is ConflictKind.MERGING for lane in lanes)
    if not merging or leaders_until_m <= length_m:
        return []
    text = f"the map ends {length_m - goal_m:.1f} m past the goal, and with it who has merged"
    return [text]
