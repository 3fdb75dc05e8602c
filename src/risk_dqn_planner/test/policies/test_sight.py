# SPDX-License-Identifier: Apache-2.0
"""How far the ego will see: similar triangles past a corner."""

from collections.abc import Callable

import numpy as np
import pytest

from risk_dqn_planner.policies.foresight.sight import SightLines, hidden_from
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
NEW, KEPT = np.array([True]), np.array([False])


def looking(situation: Make, ego_m: float, hidden_m: float) -> Situations:
    return situation([{"id": 3, "ego_m": ego_m, "hidden_m": hidden_m}])


def test_two_looks_tell_where_the_corner_stands(situation: Make) -> None:
    # Corner 5 m before the lane and 6 m beside the path: 6 * 20 / 15 and 6 * 15 / 10.
    sight = SightLines(2.0)
    assert sight.corner_m(looking(situation, 20.0, 8.0), NEW)[0, 0] == 2.0
    found_m = sight.corner_m(looking(situation, 15.0, 9.0), KEPT)
    assert found_m[0, 0] == pytest.approx(5.0)
    # And from 8 m on the lane will be seen for 6 * 8 / 3.
    assert hidden_from(9.0, 15.0, 5.0, 7.0) == pytest.approx(16.0)


def test_an_ego_that_stands_keeps_what_it_knows(situation: Make) -> None:
    sight = SightLines(2.0)
    sight.corner_m(looking(situation, 20.0, 8.0), NEW)
    sight.corner_m(looking(situation, 15.0, 9.0), KEPT)
    assert sight.corner_m(looking(situation, 15.0, 7.0), KEPT)[0, 0] == pytest.approx(5.0)
    assert sight.corner_m(looking(situation, 15.0, 7.0), NEW)[0, 0] == 2.0


def test_sight_that_does_not_grow_gives_the_nearest_corner(situation: Make) -> None:
    sight = SightLines(2.0)
    sight.corner_m(looking(situation, 20.0, 40.0), NEW)
    assert sight.corner_m(looking(situation, 15.0, 40.0), KEPT)[0, 0] == 2.0


def test_nothing_is_expected_to_be_seen_less_far() -> None:
    for way_m in np.arange(0.0, 30.0, 0.5):
        for corner_m in (0.0, 2.5, 19.0, 25.0):
            assert hidden_from(12.0, 20.0, corner_m, way_m) >= 12.0
