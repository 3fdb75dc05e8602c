# SPDX-License-Identifier: Apache-2.0
"""Where two vehicles on two lines can touch: the conflict zones of the paper, from geometry.

In the plane of the two arc lengths, positions at which the footprints overlap form connected
sets. The bounding interval of such a set on either line is the conflict zone there.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.geometry.contact_kernels import (
    MARGIN_M,
    Labels,
    Shape,
    contact_edge,
    label,
    poses,
    touches,
)
from risk_dqn_planner.geometry.polyline import Polyline

Floats = NDArray[np.float64]

STEP_M = 0.1


@dataclass(frozen=True)
class Interval:
    """A stretch of arc length [m]."""

    start: float
    end: float

    @property
    def length(self) -> float:
        """End less start."""
        return self.end - self.start

    @property
    def center(self) -> float:
        """Half-way between start and end."""
        return 0.5 * (self.start + self.end)

    def union(self, other: "Interval") -> "Interval":
        """Return the least interval that holds both."""
        return Interval(min(self.start, other.start), max(self.end, other.end))

    def gap(self, other: "Interval") -> float:
        """Return how far apart the intervals lie; negative by how much they overlap."""
        return max(self.start, other.start) - min(self.end, other.end)

    def shifted(self, by: float) -> "Interval":
        """Return the interval moved along."""
        return Interval(self.start + by, self.end + by)


@dataclass(frozen=True, eq=False)
class ContactMap:
    """Positions on two lines at which footprints overlap, as numbered connected sets.

    s1 (N,), s2 (M,): sampled arc lengths. labels (N, M): number of the contact, from 1; 0 none.
    """

    line1: Polyline
    line2: Polyline
    shape1: Shape
    shape2: Shape
    s1: Floats
    s2: Floats
    labels: Labels
    count: int

    def merged(self, gap1_m: float, gap2_m: float) -> "ContactMap":
        """Return the map with contacts joined that lie this close on both lines.

        Lines that run about a width apart touch and part again; no vehicle fits between.
        """
        boxes = [self._box(number) for number in range(1, self.count + 1)]
        numbers = _group(boxes, gap1_m, gap2_m)
        table = np.array([0, *numbers], dtype=np.int64)
        return replace(self, labels=table[self.labels], count=max(numbers, default=0))

    def _box(self, number: int) -> tuple[Interval, Interval]:
        """Return a contact's bounding intervals as sampled."""
        mask = self.labels == number
        s1, s2 = self.s1[mask.any(axis=1)], self.s2[mask.any(axis=0)]
        return Interval(float(s1[0]), float(s1[-1])), Interval(float(s2[0]), float(s2[-1]))

    def at(self, s1: float, s2: float) -> int:
        """Return the number of the contact at the sample nearest to two arc lengths."""
        row = int(np.argmin(np.abs(self.s1 - s1)))
        column = int(np.argmin(np.abs(self.s2 - s2)))
        return int(self.labels[row, column])

    def within(self, number: int, stretch1: Interval, stretch2: Interval) -> bool:
        """Tell whether a contact occurs while both positions are in these stretches."""
        rows = (self.s1 >= stretch1.start) & (self.s1 <= stretch1.end)
        columns = (self.s2 >= stretch2.start) & (self.s2 <= stretch2.end)
        return bool((self.labels[np.ix_(rows, columns)] == number).any())

    def zone(self, number: int) -> tuple[Interval, Interval]:
        """Return the bounding intervals of a contact on both lines, refined beyond sampling."""
        mask = self.labels == number
        first = (self.line1, self.shape1, self.s1)
        second = (self.line2, self.shape2, self.s2)
        return _extent(mask, first, second), _extent(mask.T, second, first)


Side = tuple[Polyline, Shape, Floats]


def _extent(mask: NDArray[np.bool_], along: Side, across: Side) -> Interval:
    """Return a contact's interval on the line `along`; mask (N along, M across)."""
    line, shape, s = along
    rows = np.flatnonzero(mask.any(axis=1))
    ends = []
    for row, limit in ((rows[0], s[0]), (rows[-1], s[-1])):
        other_line, other_shape, other_s = across
        columns = other_s[np.flatnonzero(mask[row])]
        step = math.copysign(STEP_M, limit - s[row]) if limit != s[row] else 0.0
        ends.append(
            contact_edge(
                line.xy, line.s, shape, other_line.xy, other_line.s, other_shape,
                float(s[row]), step, float(limit),
                max(float(columns[0]) - MARGIN_M, float(other_s[0])),
                min(float(columns[-1]) + MARGIN_M, float(other_s[-1])),
                float(other_s[0]), float(other_s[-1]),
            )
        )  # fmt: skip
    return Interval(float(ends[0]), float(ends[1]))


def _group(boxes: list[tuple[Interval, Interval]], gap1_m: float, gap2_m: float) -> list[int]:
    """Return for each box its group's number, from 1; boxes this close belong together."""
    groups: list[tuple[Interval, Interval, list[int]]] = []
    for index, box in enumerate(boxes):
        grown = (*box, [index])
        # A box may bridge groups that were apart so far, and reach others once it has grown.
        while near := [
            group
            for group in groups
            if group[0].gap(grown[0]) <= gap1_m and group[1].gap(grown[1]) <= gap2_m
        ]:
            for group in near:
                groups.remove(group)
                members = [*grown[2], *group[2]]
                grown = (grown[0].union(group[0]), grown[1].union(group[1]), members)
        groups.append(grown)
    numbers = [0] * len(boxes)
    for number, (_, _, members) in enumerate(groups, start=1):
        for index in members:
            numbers[index] = number
    return numbers


def find_contacts(
    line1: Polyline,
    stretch1: Interval,
    shape1: Shape,
    line2: Polyline,
    stretch2: Interval,
    shape2: Shape,
) -> ContactMap:
    """Find all contacts of vehicles of given shapes (length, width) on stretches of two lines."""
    s1, s2 = _samples(stretch1), _samples(stretch2)
    step2 = float(s2[1] - s2[0])
    grid = touches(
        poses(line1.xy, line1.s, s1), shape1, poses(line2.xy, line2.s, s2), shape2, step2
    )
    labels, count = label(grid)
    return ContactMap(line1, line2, shape1, shape2, s1, s2, labels, int(count))


def _samples(stretch: Interval) -> Floats:
    """Return arc lengths (N,) that include both ends, at most STEP_M apart."""
    count = max(math.ceil(stretch.length / STEP_M), 1) + 1
    return np.linspace(stretch.start, stretch.end, count)
