# SPDX-License-Identifier: Apache-2.0
"""Which outlines cross themselves, and what they enclose."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.geometry.polygon import crossing_edges, enclosed_area_kernel

TOLERANCE_M = 0.1
SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
# Coordinates that often coincide, so that edges touch and overlap too.
near = st.integers(-4, 4).map(float) | st.floats(-4.0, 4.0)
outlines = st.lists(st.tuples(near, near), min_size=3, max_size=12)


def crosses(corners: np.ndarray, i: int, j: int) -> bool:
    """Whether both ends of each edge are clearly on either side of the other."""

    def beside(i: int, j: int) -> list[float]:
        (p, q), ends = corners[[i, (i + 1) % len(corners)]], corners[[j, (j + 1) % len(corners)]]
        along = q - p
        length_m = float(np.hypot(*along))
        if length_m <= 0.0:
            return [0.0, 0.0]
        return sorted((along[0] * (ends - p)[:, 1] - along[1] * (ends - p)[:, 0]) / length_m)

    sides = beside(i, j), beside(j, i)
    return all(low < -TOLERANCE_M and high > TOLERANCE_M for low, high in sides)


@given(outlines)
def test_the_first_two_edges_that_cross_are_those_a_comparison_of_all_finds(
    corners: list[tuple[float, float]],
) -> None:
    outline, count = np.array(corners), len(corners)
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
    apart = [(i, j) for i, j in pairs if j - i not in (1, count - 1)]
    expected = next((pair for pair in apart if crosses(outline, *pair)), (-1, -1))
    assert crossing_edges(outline, TOLERANCE_M) == expected


@pytest.mark.parametrize(
    ("corners", "found"),
    [
        (SQUARE, (-1, -1)),
        # A bow tie: both diagonals are edges.
        ([SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]], (0, 2)),
        # A spike that goes out to the other side by less than the tolerance only touches.
        ([*SQUARE, (2.0, -0.05)], (-1, -1)),
        ([*SQUARE, (2.0, -1.0)], (0, 3)),
    ],
)
def test_an_outline_may_touch_itself_but_not_cross(
    corners: list[tuple[float, float]], found: tuple[int, int]
) -> None:
    assert crossing_edges(np.array(corners), TOLERANCE_M) == found


def test_the_area_of_a_square_is_the_same_both_ways_round() -> None:
    for corners in (SQUARE, SQUARE[::-1]):
        assert enclosed_area_kernel(np.array(corners)) == 16.0
