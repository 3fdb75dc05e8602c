# SPDX-License-Identifier: Apache-2.0
"""The ego's path: the route asked for, extended so that it can be approached and left."""

from collections.abc import Sequence
from dataclasses import dataclass

from risk_dqn_planner.geometry.contact import Interval
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.map.centerline import LaneletChain, chain
from risk_dqn_planner.map.loader import Lanelet, RoadMap, lanelet_key
from risk_dqn_planner.map.route import resolve_route, straight_downstream, straight_upstream

# Room for zones that reach beyond the route's last lanelet.
SPARE_M = 10.0


@dataclass(frozen=True, eq=False)
class EgoRoute:
    """The ego's lanelets; `chain.lanelets[first:last + 1]` is the route as given."""

    chain: LaneletChain
    first: int
    last: int

    @property
    def route_lanelets(self) -> tuple[Lanelet, ...]:
        """The lanelets asked for; only with these conflicts are sought."""
        return self.chain.lanelets[self.first : self.last + 1]

    @property
    def route_stretch(self) -> Interval:
        """Arc lengths that the route as given covers."""
        return Interval(self.chain.starts_m[self.first], self.chain.end_m(self.last))

    @property
    def ids(self) -> frozenset[int]:
        """Ids of all lanelets of the path."""
        return frozenset(self.chain.lanelet_ids)

    def index_of(self, lanelet: Lanelet) -> int | None:
        """Return where a lanelet, driven in its direction, is on the path."""
        key = lanelet_key(lanelet)
        return next(
            (i for i, own in enumerate(self.chain.lanelets) if lanelet_key(own) == key), None
        )

    def index_with_start(self, lanelet: Lanelet) -> int | None:
        """Return which lanelet of the path starts where this one starts."""
        return self._index_at(lanelet, 0)

    def index_with_end(self, lanelet: Lanelet) -> int | None:
        """Return which lanelet of the path ends where this one ends."""
        return self._index_at(lanelet, -1)

    def _index_at(self, lanelet: Lanelet, end: int) -> int | None:
        points = border_points(lanelet, end)
        return next(
            (i for i, own in enumerate(self.chain.lanelets) if border_points(own, end) == points),
            None,
        )


def border_points(lanelet: Lanelet, end: int) -> tuple[int, int]:
    """Return the ids of the border points at a lanelet's start (0) or end (-1)."""
    left, right = lanelet.leftBound, lanelet.rightBound
    return int(left[end % len(left)].id), int(right[end % len(right)].id)


def ego_route(road_map: RoadMap, route: Sequence[int], config: IntersectionConfig) -> EgoRoute:
    """Resolve the route and go straight on at both ends; no lanelet comes twice.

    Raises:
        RouteError: the route cannot be driven, see `resolve_route`.
    """
    lanelets = resolve_route(road_map, route)
    before = straight_upstream(road_map, lanelets[0], config.ego_upstream_m, route)
    used = {*route, *(int(lanelet.id) for lanelet in before)}
    onward_m = SPARE_M + config.goal_beyond_m + config.leaders_beyond_goal_m
    after = straight_downstream(road_map, lanelets[-1], onward_m, used)
    return EgoRoute(
        chain=chain([*before, *lanelets, *after]),
        first=len(before),
        last=len(before) + len(lanelets) - 1,
    )
