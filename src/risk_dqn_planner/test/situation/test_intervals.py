# SPDX-License-Identifier: Apache-2.0
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.situation.intervals import insert, intersect

Pairs = list[tuple[float, float]]


class Row:
    """A set with room for `room` intervals."""

    def __init__(self, pairs: Pairs, room: int = 6) -> None:
        self.near, self.far = np.zeros((1, room + 1)), np.zeros((1, room + 1))
        self.count = 0
        for low, high in pairs:
            self.count = insert(self.near, self.far, 0, self.count, low, high)

    def pairs(self) -> Pairs:
        return [(float(self.near[0, k]), float(self.far[0, k])) for k in range(self.count)]


def shared(a: Row, b: Row, room: int = 6) -> Pairs:
    out = Row([], room)
    out.count = intersect(
        a.near, a.far, 0, a.count, b.near, b.far, 0, b.count, out.near, out.far, 0
    )
    return out.pairs()


def test_intervals_are_kept_in_order_whatever_the_order_they_come_in() -> None:
    assert Row([(10, 12), (0, 1), (5, 6)]).pairs() == [(0, 1), (5, 6), (10, 12)]


def test_an_interval_swallows_those_it_overlaps_or_touches() -> None:
    assert Row([(0, 1), (4, 5), (8, 9), (12, 13), (5, 8.5)]).pairs() == [(0, 1), (4, 9), (12, 13)]


def test_where_there_is_no_room_the_two_closest_become_one() -> None:
    assert Row([(0, 1), (10, 11), (13, 14), (20, 21)], room=3).pairs() == [
        (0, 1),
        (10, 14),
        (20, 21),
    ]


def test_the_new_interval_may_be_one_of_the_two_closest() -> None:
    assert Row([(0, 1), (10, 11), (20, 21), (2, 3)], room=3).pairs() == [
        (0, 3),
        (10, 11),
        (20, 21),
    ]


def test_sets_share_the_overlaps_of_their_intervals() -> None:
    a, b = Row([(0, 5), (10, 20)]), Row([(-1, 1), (4, 12), (19, 30)])
    assert shared(a, b) == [(0, 1), (4, 5), (10, 12), (19, 20)]


def test_sets_that_are_apart_share_nothing() -> None:
    assert shared(Row([(0, 1), (5, 6)]), Row([(2, 4), (7, 8)])) == []


# Numbers of at most two digits: whole-numbered ends and halves tell all sets apart.
pairs = st.lists(
    st.tuples(st.integers(0, 40), st.integers(0, 6)).map(lambda p: (p[0], p[0] + p[1])),
    max_size=12,
)


def halves(intervals: Pairs) -> set[float]:
    """The whole and half numbers in a set."""
    return {0.5 * k for k in range(100) for low, high in intervals if low <= 0.5 * k <= high}


@given(pairs)
def test_a_set_holds_what_was_put_in_and_nothing_else(intervals: Pairs) -> None:
    assert halves(Row(intervals, room=12).pairs()) == halves(intervals)


@given(pairs, st.integers(1, 4))
def test_a_set_without_room_only_grows(intervals: Pairs, room: int) -> None:
    kept = Row(intervals, room).pairs()
    assert len(kept) <= room
    assert halves(kept) >= halves(intervals)
    if intervals:
        # Not beyond its ends.
        assert kept[0][0] == min(low for low, _ in intervals)
        assert kept[-1][1] == max(high for _, high in intervals)


@given(pairs, pairs)
def test_an_intersection_holds_what_both_hold(one: Pairs, other: Pairs) -> None:
    both = shared(Row(one, 12), Row(other, 12), room=24)
    assert halves(both) == halves(one) & halves(other)
