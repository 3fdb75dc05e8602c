# SPDX-License-Identifier: Apache-2.0
"""Where paths run on the same lane, so that vehicles on different paths follow one another.

Found from the centrelines alone: two lanes that fork or join have the same centreline before or
behind the place.
"""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.geometry.polyline import MIN_POINT_SPACING_M, Polyline
from risk_dqn_planner.intersection.model import ConflictKind, IntersectionModel
from risk_dqn_planner.situation.situations import Booleans, Floats
from risk_dqn_planner.vehicle import VehicleDimensions
from sim_bridge.world.contact import touching_paths
from sim_bridge.world.path_geometry import Shared, cut, shared_stretch

# Vehicles on joining branches take each other for leaders from so far before the join.
JOIN_VIEW_M = 15.0
_END_M = 1.0
# No vehicle drives further than this between two decisions.
_PER_DECISION_M = 10.0


class Sharing(NamedTuple):
    """Row p, column q, all (P, P): vehicle at s on path q is on or near path p.

    It is so for low_m <= s <= high_m (none: infinity and minus infinity), at s + offset_m on p.
    touches (P, P): footprints on both paths may touch somewhere, be it at a crossing.
    change_low_m, change_high_m (P,): only where a vehicle is between them on its path can it
    change who follows whom, but by coming or leaving: at joins and forks.
    """

    low_m: Floats
    high_m: Floats
    offset_m: Floats
    touches: Booleans
    change_low_m: Floats
    change_high_m: Floats


class EgoSharing(NamedTuple):
    """The ego on path p (P,), for ego arc lengths from_m to until_m at s + offset_m on p.

    From the start of the conflict zone of a merging lane to where the paths part again. Crossing
    paths: from infinity.
    """

    from_m: Floats
    until_m: Floats
    offset_m: Floats


class TrafficLines(NamedTuple):
    """The part of each conflict path that vehicles drive, in the model's order (P of them).

    line: from where they enter to where they leave; shift_m: from arc length on the model's path
    to arc length on the line; enters: whether new vehicles come in on it.
    """

    line: list[Polyline]
    shift_m: list[float]
    enters: list[bool]


def traffic_lines(model: IntersectionModel, upstream_m: float, beyond_m: float) -> TrafficLines:
    """Cut each path from `upstream_m` before its zone's centre to `beyond_m` behind it.

    Vehicles on a merging path go on until the ego's goal. They do not enter on a path that begins
    nearer than `upstream_m` if another path of the lane reaches so far.
    """
    lines, shifts, enters = [], [], []
    for lane in model.lanes:
        reaching = [path.zone_center_m >= upstream_m for path in lane.paths]
        enters += reaching if any(reaching) else [True] * len(reaching)
        for path in lane.paths:
            end = path.zone_center_m + beyond_m
            if lane.kind == ConflictKind.MERGING:
                end = max(end, path.join_m + model.goal_m - lane.ego_join_m)
            begin = max(path.zone_center_m - upstream_m, 0.0)
            lines.append(cut(path.path.centerline, begin, end))
            shifts.append(-begin)
    grown = [_grown(line, lines) for line in lines]
    return TrafficLines(
        [line for line, _ in grown],
        [shift + more for shift, (_, more) in zip(shifts, grown, strict=True)],
        enters,
    )


def _grown(line: Polyline, lines: list[Polyline]) -> tuple[Polyline, float]:
    """Lengthen a line upstream along the one that reaches furthest up the same lane.

    So vehicles of all paths of a road enter at the same place, and none appears where another
    path's upstream part is still seen.
    """
    upstream, longest = 0.0, line
    for other in lines:
        stretch = shared_stretch(line, other, 0.0) if other is not line else None
        # The line's start lies on the other line, that far from the other's own start.
        if stretch is None or stretch.low_m + stretch.offset_m > _END_M:
            continue
        if -stretch.offset_m > upstream + MIN_POINT_SPACING_M:
            upstream, longest = -stretch.offset_m, other
    if longest is line:
        return line, 0.0
    before = longest.xy[longest.s < upstream - 1e-3]
    return Polyline.from_points(np.concatenate((before, line.xy))), upstream


def sharing(lines: list[Polyline], tables: Floats, vehicle: VehicleDimensions) -> Sharing:
    """Compare all pairs of lines, given also as poses (P, K, 3).

    Vehicles within their width of a forking line count as on it.
    """
    count = len(lines)
    table = Sharing(
        low_m=np.full((count, count), np.inf),
        high_m=np.full((count, count), -np.inf),
        offset_m=np.zeros((count, count)),
        touches=touching_paths(tables, vehicle),
        change_low_m=np.full(count, np.inf),
        change_high_m=np.full(count, -np.inf),
    )
    for p, line in enumerate(lines):
        for q, other in enumerate(lines):
            if p == q:
                table.low_m[p, q], table.high_m[p, q] = -np.inf, np.inf
                continue
            stretch = shared_stretch(line, other, vehicle.width_m)
            if stretch is not None:
                low, high = _interval(stretch, line, other)
                table.low_m[p, q], table.high_m[p, q] = low, high
                table.offset_m[p, q] = stretch.offset_m
                # From the join's view to the join, from the fork to where it is left behind.
                changes = ([low, stretch.low_m] if low > -np.inf else []) + (
                    [stretch.high_m, high] if high < np.inf else []
                )
                for s in changes:
                    table.change_low_m[q] = min(table.change_low_m[q], s - _PER_DECISION_M)
                    table.change_high_m[q] = max(table.change_high_m[q], s + _PER_DECISION_M)
    return table


def _interval(stretch: Shared, line: Polyline, other: Polyline) -> tuple[float, float]:
    """Return where on the other line a vehicle counts: from the join's view, past the fork."""
    at_start = stretch.low_m < _END_M or stretch.low_m + stretch.offset_m < _END_M
    at_end = (
        stretch.high_m > other.length_m - _END_M
        or stretch.high_m + stretch.offset_m > line.length_m - _END_M
    )
    low = -np.inf if at_start else stretch.low_m - JOIN_VIEW_M
    return low, np.inf if at_end else stretch.near_until_m


def sharing_with_ego(
    model: IntersectionModel, lanes: list[int], traffic: TrafficLines
) -> EgoSharing:
    """Relate the ego's path to each path; `lanes` (P,) are the indices of their lanes."""
    count = len(traffic.line)
    table = EgoSharing(np.full(count, np.inf), np.full(count, -np.inf), np.zeros(count))
    conflicts = [path for lane in model.lanes for path in lane.paths]
    for p, index in enumerate(lanes):
        lane = model.lanes[index]
        if lane.kind != ConflictKind.MERGING:
            continue
        table.from_m[p] = lane.ego_zone_center_m - 0.5 * lane.ego_zone_length_m
        table.until_m[p] = np.inf
        table.offset_m[p] = conflicts[p].join_m + traffic.shift_m[p] - lane.ego_join_m
        line = traffic.line[p]
        stretch = shared_stretch(line, model.ego_path.centerline, 0.5)
        # Where the paths part again, unless the vehicles' own path ends before.
        if stretch is None or stretch.high_m <= lane.ego_join_m:
            continue
        if stretch.high_m + stretch.offset_m < line.length_m - _END_M:
            table.until_m[p] = stretch.near_until_m
    return table
