# SPDX-License-Identifier: Apache-2.0
"""Vehicles that go out of sight between an older visible area and the objects stay possible."""

import math

import numpy as np
import pytest

from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.inputs import EgoPose, ObjectArrays, object_arrays
from risk_dqn_planner.situation.situations import Floats
from risk_dqn_planner.situation.warm_up import crossing_model, square

EGO = EgoPose(-20.0, 0.0, 0.0, 4.0)
HIDDEN_FROM_S = 0.25
# Lane 1 comes from the south and is then seen for 10 m only.
TEN_METRES = np.array([[-80.0, -10.0], [80.0, -10.0], [80.0, 80.0], [-80.0, 80.0]])


def area_at(time_s: float) -> Floats:
    return square(80.0) if time_s < HIDDEN_FROM_S else TEN_METRES


def place_at(time_s: float) -> float:
    """How far before the zone's centre the vehicle is: 22 m at first, at 2 m/s."""
    return 22.0 - 2.0 * time_s


def objects_at(time_s: float) -> ObjectArrays:
    seen = [[0.0, -place_at(time_s), math.pi / 2, 2.0]]
    return object_arrays(seen if time_s < HIDDEN_FROM_S else [])


def hidden_distances(memory: str, age_s: float, times_s: Floats) -> list[float]:
    builder = SituationBuilder(crossing_model(), SituationConfig(memory=memory))
    found = []
    for time_s in map(float, times_s):
        s = builder.build(EGO, objects_at(time_s), area_at(time_s - age_s), age_s, time_s)
        found.append(float(s.lane_hidden_distance_m[0, 0]))
    return found


@pytest.mark.parametrize("memory", ["tracked", "instantaneous"])
@pytest.mark.parametrize("age_s", [0.0, 0.02, 0.095, 0.2, 0.45])
def test_the_vehicle_is_never_nearer_than_what_is_told(memory: str, age_s: float) -> None:
    times_s = np.arange(0.0, 3.0, 0.1)
    for time_s, hidden_m in zip(times_s, hidden_distances(memory, age_s, times_s), strict=True):
        if time_s >= HIDDEN_FROM_S:
            assert hidden_m <= place_at(float(time_s))


@pytest.mark.parametrize("memory", ["tracked", "instantaneous"])
def test_what_is_told_is_not_worse_than_what_it_may_have_driven(memory: str) -> None:
    first = hidden_distances(memory, 0.095, np.arange(0.0, 0.35, 0.1))[-1]
    # Seen at 21.6 m a period ago; 7 m/s and half a metre for where it was.
    assert first == pytest.approx(21.6 - 0.7 - 0.5)


def test_who_is_still_perceived_is_not_missed() -> None:
    builder = SituationBuilder(crossing_model())
    for time_s, y in ((0.0, 2.9), (0.1, 3.2)):
        seen = object_arrays([[0.0, y, math.pi / 2, 3.0]])
        s = builder.build(EGO, seen, square(80.0), 0.095, time_s)
    assert s.lane_hidden_distance_m[0, 0] == pytest.approx(70.0 - 7.0 * 0.095)


def test_an_errand_or_an_earlier_time_misses_nobody_of_before() -> None:
    for begins_anew in (True, False):
        builder = SituationBuilder(crossing_model())
        builder.build(EGO, objects_at(0.0), square(80.0), 0.095, 10.0)
        if begins_anew:
            builder.forget()
        later_s = 10.1 if begins_anew else 9.0
        s = builder.build(EGO, object_arrays(), square(80.0), 0.095, later_s)
        assert s.lane_hidden_distance_m[0, 0] == pytest.approx(70.0 - 7.0 * 0.095)
