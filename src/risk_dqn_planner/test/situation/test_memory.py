# SPDX-License-Identifier: Apache-2.0
"""What is remembered of lane 1: 70 m long, limit 7 m/s, its zone from 3 m to -3 m.

Distances are to the zone's centre; the end of what is looked at is 70 m, the sensor's range.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import ConflictPath, IntersectionModel, LanePath
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.config import SituationConfig, TrackingConfig
from risk_dqn_planner.situation.hidden_space import INTERVALS
from risk_dqn_planner.situation.inputs import EgoPose, object_arrays
from risk_dqn_planner.situation.situations import Floats
from risk_dqn_planner.situation.warm_up import crossing_model

NORTH = math.pi / 2
EXIT, END = -3.0, 70.0

STANDING = EgoPose(-20.0, 0.0, 0.0, 0.0)

Pairs = Sequence[tuple[float, float]]


def area(hidden: Pairs, reach: float = 100.0) -> Floats:
    """All within `reach`, less notches from the right that hide parts of lane 1."""
    corners = [(-reach, -reach), (reach, -reach)]
    # The lane is at y = -distance: going up, the furthest comes first.
    for near, far in sorted(hidden, reverse=True):
        corners += [(reach, -far), (-5.0, -far), (-5.0, -near), (reach, -near)]
    return np.array([*corners, (reach, reach), (-reach, reach)], dtype=np.float64)


class Watcher:
    """An ego that stands 20 m before the crossing and remembers, and one that does not."""

    def __init__(
        self, model: IntersectionModel | None = None, margin_m: float = 0.0, **tracking: float
    ) -> None:
        tracked = TrackingConfig(vehicle_margin_m=margin_m, **tracking)
        chosen = model or crossing_model()
        self.builder = SituationBuilder(chosen, SituationConfig(memory="tracked", tracking=tracked))
        self.plain = SituationBuilder(chosen)

    def look(
        self,
        time_s: float,
        hidden: Pairs,
        vehicles: dict[int, float] | None = None,
        ego: EgoPose = STANDING,
        age_s: float = 0.0,
    ) -> float:
        """Look at vehicles given as distance by id; return d_o."""
        seen = vehicles or {}
        objects = object_arrays([[0.0, -d, NORTH, 5.0] for d in seen.values()], list(seen))
        situations = self.builder.build(ego, objects, area(hidden), age_s, time_s)
        now = self.plain.build(ego, objects, area(hidden)).lane_hidden_distance_m
        found = situations.lane_hidden_distance_m
        exact = not age_s and not self.builder.config.tracking.visible_margin_m
        assert not exact or (found >= now - 1e-9).all()
        return float(found[0, 0])

    @property
    def sets(self) -> list[list[tuple[float, float]]]:
        assert self.builder.memory is not None
        return [
            [(round(near, 4), round(far, 4)) for near, far in pairs]
            for pairs in self.builder.memory.intervals()
        ]

    @property
    def set(self) -> list[tuple[float, float]]:
        """Of the only path, without what rounding adds."""
        return self.sets[0]


def test_at_the_first_look_all_that_is_hidden_may_hold_a_vehicle() -> None:
    watcher = Watcher()
    assert watcher.look(0.0, [(20, 30), (50, 60)]) == pytest.approx(20.0)
    assert watcher.set == [(20, 30), (50, 60)]


def test_what_hides_nobody_stays_free_for_as_long_as_nobody_can_get_there() -> None:
    watcher = Watcher()
    # Everything is seen at first; then a notch hides 20 to 30 m: free, and nobody is near.
    assert watcher.look(0.0, []) == END
    assert watcher.look(1.0, [(20, 30)]) == END
    assert watcher.set == []
    # From beyond the end it is 40 m to the notch, 5.7 s, and on the way everyone is seen.
    for k in range(1, 100):
        assert watcher.look(1.0 + 0.5 * k, [(20, 30)]) == END


def test_the_set_grows_at_its_near_end_with_the_limit() -> None:
    watcher = Watcher()
    watcher.look(0.0, [(40, 50)])
    # The shadow grows by 10 m towards the zone, hidden vehicles may drive 3.5 m.
    assert watcher.look(0.5, [(30, 50)]) == pytest.approx(36.5)
    assert watcher.look(1.0, [(30, 50)]) == pytest.approx(33.0)
    assert watcher.look(1.5, [(30, 50)]) == pytest.approx(30.0)
    assert watcher.set == [(30, 50)]


def test_a_hidden_vehicle_may_have_a_least_speed_and_a_greater_one_than_the_limit() -> None:
    watcher = Watcher(min_speed_mps=2.0, speed_factor=1.2)
    watcher.look(0.0, [(40, 50)])
    assert watcher.look(0.5, [(30, 50)]) == pytest.approx(40.0 - 0.5 * 8.4)
    assert watcher.set == [(35.8, 49.0)]
    # Meanwhile from beyond the end one may have come to 57.4 m.
    watcher.look(2.0, [(30, 50)])
    assert watcher.set == [(30.0, 46.0)]


def test_the_set_loses_what_is_seen_and_never_gets_it_back() -> None:
    watcher = Watcher()
    watcher.look(0.0, [(20, 40)])
    watcher.look(0.0, [(20, 22), (38, 40)])
    assert watcher.set == [(20, 22), (38, 40)]
    # What comes out of the upper rest is hidden again, the lower rest comes to the lower end.
    watcher.look(0.5, [(10, 40)])
    assert watcher.set == [(16.5, 22), (34.5, 40)]


def test_who_drives_from_shadow_to_shadow_between_two_looks_is_not_lost() -> None:
    watcher = Watcher()
    watcher.look(0.0, [(40, 50)])
    # 2 m between the shadows are passed in 0.29 s.
    watcher.look(0.5, [(30, 38), (40, 50)])
    assert watcher.set == [(36.5, 38), (40, 50)]


def test_vehicles_come_from_beyond_the_end() -> None:
    watcher = Watcher()
    watcher.look(0.0, [])
    watcher.look(1.0, [(50, 70)])
    assert watcher.set == [(63, 70)]


def test_a_vehicle_that_was_seen_and_then_hidden_is_in_the_set() -> None:
    watcher = Watcher(margin_m=0.5)
    watcher.look(0.0, [], {7: 31.0})
    assert watcher.set == []
    assert watcher.look(1.0, [(20, 30)]) == pytest.approx(23.5)
    assert watcher.set == [(23.5, 30)]
    assert watcher.look(2.0, [(10, 30)]) == pytest.approx(16.5)


def test_a_vehicle_that_stays_in_sight_hides_nowhere() -> None:
    watcher = Watcher()
    watcher.look(0.0, [], {7: 31.0, 9: 50.0})
    watcher.look(1.0, [(20, 30)], {9: 44.0, 7: 30.5})
    assert watcher.set == []


def test_a_vehicle_that_changes_its_number_is_taken_for_lost() -> None:
    watcher = Watcher()
    watcher.look(0.0, [], {7: 31.0})
    watcher.look(1.0, [(20, 30)], {8: 30.5})
    assert watcher.set == [(24, 30)]


def test_after_a_gap_in_perception_the_set_is_as_wide_as_the_gap_was_long() -> None:
    watcher = Watcher()
    watcher.look(0.0, [(40, 45)])
    assert watcher.look(3.0, [(0, 45)]) == pytest.approx(19.0)
    # Long enough, and all that is hidden may hold someone.
    assert watcher.look(60.0, [(0, 45)]) == pytest.approx(0.0)


@pytest.mark.parametrize("time_s", [-1.0, math.inf, math.nan])
def test_where_time_says_nothing_everything_hidden_counts(time_s: float) -> None:
    watcher = Watcher()
    watcher.look(0.0, [], {7: 60.0})
    watcher.look(time_s, [(20, 30)])
    assert watcher.set == [(20, 30)]


def test_the_same_look_twice_changes_nothing() -> None:
    watcher = Watcher()
    watcher.look(0.0, [(40, 50)])
    for _ in range(3):
        watcher.look(0.5, [(30, 50)])
        assert watcher.set == [(36.5, 50)]


def test_an_ego_that_has_jumped_starts_anew_and_one_that_drove_does_not() -> None:
    watcher = Watcher()
    watcher.look(0.0, [])
    watcher.look(1.0, [(20, 30)], ego=EgoPose(-15.0, 0.0, 0.0, 5.0))
    assert watcher.set == []
    # 5 m by its speed, 2 m by tolerance, and it is 7.5 m further.
    watcher.look(2.0, [(20, 30)], ego=EgoPose(-7.5, 0.0, 0.0, 5.0))
    assert watcher.set == [(20, 30)]


def test_an_older_visible_area_is_narrowed_by_what_may_have_come_into_it() -> None:
    watcher = Watcher()
    assert watcher.look(0.0, [(40, 50)], age_s=0.2) == pytest.approx(38.6)
    assert Watcher().look(0.0, [(40, 50)], age_s=-0.2) == pytest.approx(38.6)


def test_a_margin_hides_the_places_next_to_hidden_ones() -> None:
    watcher = Watcher(visible_margin_m=1.0)
    watcher.look(0.0, [(20, 30), (69.5, 70)])
    assert watcher.set == [(19, 31), (68.5, 70)]


def test_branches_are_remembered_each_for_itself() -> None:
    model = crossing_model()
    lane = model.lanes[0]
    # The second branch begins at x = 10, 40 m away, and joins at y = -30.
    line = Polyline.from_points([[10.0, -30.0], [0.0, -30.0], [0.0, 30.0]])
    branch = ConflictPath(LanePath((1,), (0.0,), line, 1.75), 40.0, math.inf)
    watcher = Watcher(replace(model, lanes=(replace(lane, paths=(lane.paths[0], branch)),)))
    assert watcher.look(0.0, [(31, 45)]) == pytest.approx(31.0)
    assert watcher.sets == [[(31.0, 45.0)], []]
    # On the branch nobody was hidden, but vehicles come from beyond its end.
    watcher.look(1.0, [(29, 45)])
    assert watcher.sets == [[(29.0, 45.0)], [(33.0, 40.0)]]


def test_more_holes_than_there_is_room_for_only_enlarge_the_set() -> None:
    watcher = Watcher()
    notches = [(5.0 * k, 5.0 * k + 2.0 + 0.1 * k) for k in range(1, 11)]
    watcher.look(0.0, notches)
    kept = watcher.sets[0]
    assert len(kept) == INTERVALS
    assert all(any(low <= a and b <= high for low, high in kept) for a, b in notches)
    # The smallest gaps, those furthest away, were given up.
    assert kept[: INTERVALS - 1] == [pytest.approx(pair) for pair in notches[: INTERVALS - 1]]


@pytest.mark.parametrize(
    "fields",
    [{"speed_factor": 0.0}, {"min_speed_mps": -1.0}, {"vehicle_margin_m": math.nan}],
)
def test_impossible_assumptions_are_refused_by_name(fields: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(fields))):
        TrackingConfig(**fields)


def test_an_unknown_memory_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="'forever', expected 'instantaneous' or"):
        SituationConfig(memory="forever")


# A world of whole metres, looked at every second: vehicles drive 0 to 7 m between two looks.
V = 7
LOOKS = st.lists(
    st.tuples(
        st.lists(st.tuples(st.integers(-2, 69), st.integers(1, 12)), max_size=4),
        st.lists(st.integers(-2, 69), max_size=3),
        st.integers(1, 2),
    ),
    min_size=1,
    max_size=8,
)


def united(pieces: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Pieces given by near end and length, within the lane and apart."""
    result: list[tuple[int, int]] = []
    for near, length in sorted(pieces):
        far = min(near + length, int(END))
        if result and near <= result[-1][1] + 1:
            result[-1] = result[-1][0], max(far, result[-1][1])
        else:
            result.append((near, far))
    return result


def runs(places: set[int]) -> int:
    return sum(place - 1 not in places for place in places)


@settings(max_examples=300, deadline=None)
@given(LOOKS)
def test_the_set_holds_exactly_the_places_that_particles_reach(
    looks: list[tuple[list[tuple[int, int]], list[int], int]],
) -> None:
    watcher = Watcher()
    particles = set(range(int(EXIT), int(END) + 1))
    time, fits, number = 0, True, 0
    seen: dict[int, float] = {}
    for pieces, vehicles, elapsed in looks:
        hidden = united(pieces)
        places = {x for near, far in hidden for x in range(near, far + 1)}
        # Every particle may stay or drive on, those in sight at the last look too.
        if time > 0:
            particles |= {int(d) for d in seen.values()} | set(range(int(END), int(END) + 20))
            particles = {x - way for x in particles for way in range(V * elapsed + 1)}
        particles &= places
        time += elapsed
        seen = {number + k: float(d) for k, d in enumerate(vehicles) if d not in places}
        number += 3
        watcher.look(float(time), hidden, seen)
        kept = watcher.sets[0]
        got = {
            x
            for x in range(int(EXIT), int(END) + 1)
            if any(low - 1e-5 <= x <= high + 1e-5 for low, high in kept)
        }
        assert got >= particles
        fits = fits and runs(particles) <= INTERVALS and len(kept) < INTERVALS
        assert not fits or got == particles
