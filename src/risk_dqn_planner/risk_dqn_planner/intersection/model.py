# SPDX-License-Identifier: Apache-2.0
"""The intersection as the planner sees it: the ego's path, the lanes that conflict with it.

All positions along lanes are arc lengths of footprint centres [m], in driving direction.
"""

import enum
from dataclasses import dataclass

from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.vehicle import VehicleDimensions


class ConflictKind(enum.IntEnum):
    """How an intersecting lane conflicts with the ego lane (diverging lanes do not)."""

    CROSSING = 0
    MERGING = 1


@dataclass(frozen=True)
class LanePath:
    """A chain of lanelets as one centreline.

    `lanelet_starts_m[k]` is the arc length at which `lanelet_ids[k]` begins; `half_width_m`
    is half the width of the narrowest lanelet of the chain.
    """

    lanelet_ids: tuple[int, ...]
    lanelet_starts_m: tuple[float, ...]
    centerline: Polyline
    half_width_m: float


@dataclass(frozen=True)
class ConflictPath:
    """One way to come through an intersecting lane's conflict zone: upstream, zone, downstream.

    zone_center_m: arc length of the zone's centre on this path.
    join_m: merging only, arc length at which this path's centreline has joined the ego's
        (from there on it is the ego's own path); infinity for a crossing path.
    """

    path: LanePath
    zone_center_m: float
    join_m: float


@dataclass(frozen=True)
class IntersectingLane:
    """Lane L_i of the paper with its conflict zone.

    lane_id: id of the last lanelet that touches the ego's corridor; unique in a model.
    speed_limit_mps: v_o, the highest limit on the lane and its upstream lanes.
    ego_zone_center_m, ego_zone_length_m: the interval of ego arc length in which the two
        footprints can touch (l of the paper, on the ego's side).
    zone_length_m: the same interval on the lane's side. A merging zone ends where the
        centrelines have joined; behind it follows ordinary car following.
    ego_join_m: merging only, ego arc length of the join; infinity for a crossing lane.
    paths: the ways through the zone, one for each upstream branch (at least one).
    """

    lane_id: int
    kind: ConflictKind
    speed_limit_mps: float
    ego_zone_center_m: float
    ego_zone_length_m: float
    zone_length_m: float
    ego_join_m: float
    paths: tuple[ConflictPath, ...]


@dataclass(frozen=True)
class StopLine:
    """Where the ego's centre comes to rest when its front stands at the stop line.

    lanelet2_id: id of the line on the map; None where it was derived from the first zone.
    """

    position_m: float
    lanelet2_id: int | None

    @property
    def derived(self) -> bool:
        """Whether no usable line was on the map."""
        return self.lanelet2_id is None


@dataclass(frozen=True)
class IntersectionModel:
    """Everything about one ego route that does not change while driving it.

    route: the lanelets asked for; `ego_path` may reach further up- and downstream.
    lanes: ordered by (ego_zone_center_m, lane_id).
    leaders_until_m: ego arc length up to which vehicles that have merged matter, past the goal.
    notes: sentences on what the map lacked or contradicted and what was taken instead.
    """

    route: tuple[int, ...]
    ego_path: LanePath
    lanes: tuple[IntersectingLane, ...]
    stop_line: StopLine
    goal_m: float
    leaders_until_m: float
    ego_dimensions: VehicleDimensions
    traffic_dimensions: VehicleDimensions
    notes: tuple[str, ...]
