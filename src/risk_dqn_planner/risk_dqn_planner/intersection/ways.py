# SPDX-License-Identifier: Apache-2.0
"""The ways that lead through an intersecting lanelet, and where they join the ego's path."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

from risk_dqn_planner.geometry.polyline import Projection
from risk_dqn_planner.intersection.ego_route import EgoRoute
from risk_dqn_planner.intersection.model import LanePath
from risk_dqn_planner.map.centerline import LaneletChain, chain
from risk_dqn_planner.map.loader import Lanelet, RoadMap
from risk_dqn_planner.map.route import lanelet_length_m, straight_downstream

# Lines this close, with headings this close, are one lane: a follower is right behind.
JOIN_OFFSET_M = 0.25
JOIN_HEADING_RAD = 0.5
JOIN_STEP_M = 0.25
JOIN_PRECISION_M = 1e-6


class Join(NamedTuple):
    """Where a merging way has come to lie on the ego's path, in arc length of either."""

    ego_m: float
    own_m: float


@dataclass(frozen=True, eq=False)
class Way:
    """One way through a terminal: `chain.lanelets[terminal]`, what leads there, what follows.

    join: None for a way that does not come onto the ego's path.
    """

    chain: LaneletChain
    terminal: int
    join: Join | None

    @property
    def start_m(self) -> float:
        """Arc length at which the terminal begins."""
        return self.chain.starts_m[self.terminal]

    @property
    def end_m(self) -> float:
        """Arc length at which the terminal ends."""
        return self.chain.end_m(self.terminal)

    @property
    def upstream(self) -> tuple[Lanelet, ...]:
        """The terminal and the lanelets before it."""
        return self.chain.lanelets[: self.terminal + 1]

    @property
    def upstream_ids(self) -> tuple[int, ...]:
        """Ids of the lanelets up to the terminal."""
        return self.chain.lanelet_ids[: self.terminal + 1]

    def lane_path(self) -> LanePath:
        """Return the way as the model's lane path, without the map's objects."""
        return lane_path(self.chain)


def lane_path(chain: LaneletChain) -> LanePath:
    """Return a chain as the model's lane path, without the map's objects."""
    return LanePath(
        lanelet_ids=chain.lanelet_ids,
        lanelet_starts_m=chain.starts_m,
        centerline=chain.centerline,
        half_width_m=chain.half_width_m,
    )


def ways_through(
    road_map: RoadMap, ego: EgoRoute, terminal: Lanelet, upstream_m: float, downstream_m: float
) -> list[Way]:
    """Return the ways through a lanelet: every one upstream, the straightest downstream.

    They reach at least that far before the lanelet's start and past its end, where the map
    does. A way that comes onto the ego's path follows it to its end.
    """
    ways = []
    for branch in upstream_branches(road_map, terminal, upstream_m, ego.ids):
        used = {int(lanelet.id) for lanelet in (*branch, terminal)}
        after = _downstream(road_map, ego, terminal, downstream_m, used)
        ways.append(_way(ego, [*branch, terminal, *after], len(branch)))
    return ways


def upstream_branches(
    road_map: RoadMap, lanelet: Lanelet, length_m: float, avoid: Collection[int]
) -> list[list[Lanelet]]:
    """Return all ways to come to a lanelet, each in driving direction and without it.

    A way goes back until it is length_m long, the map ends, or only lanelets to avoid (by id)
    or already on it remain. The ego's path is to be avoided: what comes along it comes from
    behind the ego, and does not intersect.
    """
    if length_m <= 0.0:
        return [[]]
    used = {*avoid, int(lanelet.id)}
    before = [way for way in road_map.previous(lanelet) if int(way.id) not in used]
    if not before:
        return [[]]
    return [
        [*branch, way]
        for way in before
        for branch in upstream_branches(road_map, way, length_m - lanelet_length_m(way), used)
    ]


def _downstream(
    road_map: RoadMap, ego: EgoRoute, lanelet: Lanelet, length_m: float, used: Collection[int]
) -> list[Lanelet]:
    """Return how a vehicle goes on after a lanelet: onto the ego's path if it leads there."""
    following = next(
        (way for way in road_map.following(lanelet) if ego.index_of(way) is not None), None
    )
    if following is not None:
        return list(ego.chain.lanelets[ego.index_of(following) :])
    # Whoever turns into the ego's own two-way lanelet leaves the model there: what follows is
    # a meeting on one lane, not an intersection.
    oncoming = {int(own.id) for own in ego.chain.lanelets if road_map.drivable(own.invert())}
    after = straight_downstream(road_map, lanelet, length_m, {*used, *oncoming})
    for number, way in enumerate(after):
        index = ego.index_of(way)
        if index is not None:
            return [*after[:number], *ego.chain.lanelets[index:]]
    return after


def _way(ego: EgoRoute, lanelets: list[Lanelet], terminal: int) -> Way:
    """Build a way and find where it joins the ego's path, if it does."""
    line = chain(lanelets)
    for number, lanelet in enumerate(lanelets[terminal + 1 :], start=terminal + 1):
        index = ego.index_of(lanelet)
        if index is not None:
            meeting = Join(ego.chain.starts_m[index], line.starts_m[number])
            return Way(line, terminal, _earliest(ego, line, meeting))
    index = ego.index_with_end(lanelets[terminal])
    if index is not None:
        meeting = Join(ego.chain.end_m(index), line.end_m(terminal))
        return Way(line, terminal, _earliest(ego, line, meeting))
    return Way(line, terminal, None)


def _earliest(ego: EgoRoute, line: LaneletChain, meeting: Join) -> Join:
    """Return from where on a way and the ego's path are the same line, at the latest `meeting`.

    Lanelets may run into one another well before they end: goes back from there as long as
    the lines lie within JOIN_OFFSET_M of each other.
    """
    own_line, ego_line = line.centerline, ego.chain.centerline

    def beside(own_m: float) -> Projection:
        return ego_line.project(
            *own_line.position(own_m), own_line.heading_at(own_m), JOIN_HEADING_RAD
        )

    together_m = apart_m = meeting.own_m
    while apart_m > 0.0 and abs(beside(apart_m).lateral_m) < JOIN_OFFSET_M:
        together_m, apart_m = apart_m, apart_m - JOIN_STEP_M
    if together_m == meeting.own_m:
        return meeting
    while together_m - apart_m > JOIN_PRECISION_M:
        middle_m = 0.5 * (apart_m + together_m)
        if abs(beside(middle_m).lateral_m) < JOIN_OFFSET_M:
            together_m = middle_m
        else:
            apart_m = middle_m
    return Join(min(beside(together_m).s, meeting.ego_m), together_m)
