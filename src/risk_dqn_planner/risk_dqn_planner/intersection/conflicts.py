# SPDX-License-Identifier: Apache-2.0
"""Finds the conflicts of the ego's route: zones by contact of footprints, told apart by kind.

Consecutive lanelets in contact are one lane; it is found at its last lanelet, the terminal.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from risk_dqn_planner.geometry.contact import ContactMap, Interval, find_contacts
from risk_dqn_planner.intersection.candidates import candidates
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.intersection.ego_route import EgoRoute
from risk_dqn_planner.intersection.model import ConflictKind
from risk_dqn_planner.intersection.ways import Join, Way, ways_through
from risk_dqn_planner.map.loader import Lanelet, RoadMap, lanelet_key
from risk_dqn_planner.vehicle import VehicleDimensions

# A contact is followed this far beyond the lanelets that it was found on.
LOOK_AROUND_M = 30.0


@dataclass(frozen=True, eq=False)
class Conflict:
    """A conflict zone of one terminal.

    ego: interval of ego arc length. own: interval of the lane's arc length, counted from the
    terminal's end, which all ways through it share. A merging zone ends where the ways have
    joined. ways: those with this zone, as long as the sensor sees.
    """

    terminal: Lanelet
    kind: ConflictKind
    ego: Interval
    own: Interval
    ways: tuple[Way, ...]


def find_conflicts(road_map: RoadMap, ego: EgoRoute, config: IntersectionConfig) -> list[Conflict]:
    """Return all conflicts in the order in which the ego meets them."""
    terminals = candidates(road_map, ego, config.traffic_dimensions.length_m)
    keys = {lanelet_key(lanelet) for lanelet in terminals}
    search = _Search(road_map, ego, config, keys)
    found = [conflict for lanelet in terminals for conflict in search.at(lanelet)]
    return sorted(found, key=lambda conflict: (conflict.ego.center, lanelet_key(conflict.terminal)))


@dataclass(frozen=True, eq=False)
class _Search:
    """The conflicts at one terminal after the other."""

    road_map: RoadMap
    ego: EgoRoute
    config: IntersectionConfig
    candidate_keys: set[tuple[int, bool]]

    def at(self, terminal: Lanelet) -> list[Conflict]:
        """Return the conflicts whose last lanelet in contact this is."""
        merged: list[Conflict] = []
        # First near the terminal only, since the zone decides how far to go upstream.
        for way in self._ways(terminal, LOOK_AROUND_M):
            if way.join is None or way.join.ego_m > self.ego.route_stretch.start:
                for conflict in self._on(way):
                    _merge(merged, conflict)
        return [self._at_full_length(conflict) for conflict in merged]

    def _ways(self, terminal: Lanelet, upstream_m: float) -> list[Way]:
        length_m = self.config.downstream_m
        return ways_through(self.road_map, self.ego, terminal, upstream_m, length_m)

    def _on(self, way: Way) -> list[Conflict]:
        """Return the conflicts of one way that belong to its terminal."""
        contacts, on_terminal, ego_stretch = self._contacts(way)
        diverging = self._diverging(way, contacts)
        merging = 0 if way.join is None else contacts.at(*way.join)
        found = []
        for number in range(1, contacts.count + 1):
            if number in diverging or not contacts.within(number, ego_stretch, on_terminal):
                continue
            if self._goes_on(way, contacts, number, number == merging):
                continue
            ego, own = contacts.zone(number)
            if ego.length < self.config.hairline_m or self._passes_over(way, ego, own):
                continue
            found.append(
                Conflict(
                    terminal=way.upstream[-1],
                    kind=ConflictKind.MERGING if number == merging else ConflictKind.CROSSING,
                    ego=ego,
                    own=own.shifted(-way.end_m),
                    ways=(way,),
                )
            )
        return found

    def _contacts(self, way: Way) -> tuple[ContactMap, Interval, Interval]:
        """Return the contacts, the terminal's stretch, and the ego's within its route."""
        route = self.ego.route_stretch
        join = way.join or Join(
            min(route.end + LOOK_AROUND_M, self.ego.chain.centerline.length_m),
            min(way.end_m + LOOK_AROUND_M, way.chain.centerline.length_m),
        )
        contacts = find_contacts(
            self.ego.chain.centerline,
            Interval(max(route.start - LOOK_AROUND_M, 0.0), join.ego_m),
            _shape(self.config.ego_dimensions),
            way.chain.centerline,
            Interval(max(way.start_m - LOOK_AROUND_M, 0.0), join.own_m),
            _shape(self.config.traffic_dimensions),
        ).merged(self.config.ego_dimensions.length_m, self.config.traffic_dimensions.length_m)
        # A chain of lanelets may have joined the ego's path before its last one begins.
        on_terminal = Interval(min(way.start_m, join.own_m), way.end_m)
        return contacts, on_terminal, Interval(route.start, min(route.end, join.ego_m))

    def _diverging(self, way: Way, contacts: ContactMap) -> set[int]:
        """Return the contacts that begin where a lanelet of the way forks off the ego's path."""
        numbers = set()
        for index, lanelet in enumerate(way.upstream):
            fork = self.ego.index_with_start(lanelet)
            if fork is None:
                continue
            at_ego, at_own = self.ego.chain.starts_m[fork], way.chain.starts_m[index]
            if (
                contacts.s1[0] <= at_ego <= contacts.s1[-1]
                and contacts.s2[0] <= at_own <= contacts.s2[-1]
            ):
                numbers.add(contacts.at(at_ego, at_own))
        return numbers

    def _goes_on(self, way: Way, contacts: ContactMap, number: int, merging: bool) -> bool:
        """Tell whether the contact reaches into a further candidate, whose lane it then is."""
        following = {
            lanelet_key(after) for after in self.road_map.following(way.upstream[-1])
        } & self.candidate_keys
        if merging:
            after = way.chain.lanelets[way.terminal + 1 : way.terminal + 2]
            return any(lanelet_key(lanelet) in following for lanelet in after)
        beyond = Interval(way.end_m, float("inf"))
        anywhere = Interval(float("-inf"), float("inf"))
        return bool(following) and contacts.within(number, anywhere, beyond)

    def _passes_over(self, way: Way, ego: Interval, own: Interval) -> bool:
        """Tell whether one way lies so far above the other that they cannot touch."""
        difference = self.ego.chain.height_at(ego.center) - way.chain.height_at(own.center)
        return abs(difference) > self.config.max_height_difference_m

    def _at_full_length(self, conflict: Conflict) -> Conflict:
        """Return the conflict with its ways as long as the sensor sees upstream of the zone."""
        near = [way.upstream_ids for way in conflict.ways]
        terminal_m = conflict.ways[0].end_m - conflict.ways[0].start_m
        before_zone_m = conflict.own.start + terminal_m
        ways = self._ways(conflict.terminal, self.config.sensor_range_m - before_zone_m)
        kept = [way for way in ways if any(_same_end(way.upstream_ids, ids) for ids in near)]
        return replace(conflict, ways=tuple(kept))


def _merge(conflicts: list[Conflict], new: Conflict) -> None:
    """Add a conflict, or widen the one that it is on another way to the same terminal."""
    for index, known in enumerate(conflicts):
        overlap = known.ego.gap(new.ego) < 0.0 and known.own.gap(new.own) < 0.0
        if known.kind == new.kind and overlap:
            conflicts[index] = replace(
                known,
                ego=known.ego.union(new.ego),
                own=known.own.union(new.own),
                ways=(*known.ways, *new.ways),
            )
            return
    conflicts.append(new)


def _same_end(first: Sequence[int], second: Sequence[int]) -> bool:
    """Tell whether the shorter of two sequences is the other one's end."""
    shorter, longer = sorted((tuple(first), tuple(second)), key=len)
    return longer[len(longer) - len(shorter) :] == shorter


def _shape(dimensions: VehicleDimensions) -> tuple[float, float]:
    return dimensions.length_m, dimensions.width_m
