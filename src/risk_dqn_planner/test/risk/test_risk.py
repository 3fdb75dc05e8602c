# SPDX-License-Identifier: Apache-2.0
"""R_risk of whole situations: who counts, what is critical, what a prediction changes."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.risk.risk import (
    ActionRewards,
    RiskAssessment,
    RiskConfig,
    assess,
    predict_actions,
)
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
CONFIG = RiskConfig()
# The ego at rest has stopped 1.2 m behind the line, 4.3 m before the centre: R_CSS = -0.25. It
# leaves in sqrt(2 * 7.3 / 1.5) = 3.12 s.
BEHIND_LINE: dict[str, Any] = {"stop_line_m": -1.2, "ego_mps": 0.0}
LANE: dict[str, Any] = {"id": 3, "ego_m": 4.3}


def paper(s: Situations) -> RiskAssessment:
    return assess(s, CONFIG, include_hidden=False)


def test_nobody_there_is_no_risk(situation: Make) -> None:
    result = paper(situation())
    assert result.total.tolist() == [0.0]
    assert (result.critical_vehicle[0], result.critical_lane[0]) == (-1, -1)


def test_the_better_condition_counts_for_one_vehicle(situation: Make) -> None:
    near = {"id": 1, "lane": 3, "m": 10.0, "mps": 5.0}
    result = paper(situation([LANE], [near], **BEHIND_LINE))
    assert result.vehicle_reward[0, 0] == pytest.approx(-0.25)  # R_CSL is -1
    # 70 m away at 7 m/s: 67 / 7 - 3.12 = 6.45 s, R_CSL is 0.
    far = {"id": 1, "lane": 3, "m": 70.0, "mps": 7.0}
    assert paper(situation([LANE], [far], **BEHIND_LINE)).total[0] == 0.0


def test_the_worst_vehicle_decides(situation: Make) -> None:
    lanes = [LANE, {"id": 7, "ego_m": 3.5}]  # too near the second lane to stop: -1
    vehicles = [
        {"id": 1, "lane": 3, "m": 10.0, "mps": 5.0},
        {"id": 2, "lane": 7, "m": 10.0, "mps": 5.0},
        {"id": 3, "lane": 7, "m": 90.0, "mps": 5.0},
    ]
    result = paper(situation(lanes, vehicles, stop_line_m=-2.5))
    # Lane 3: rest 4.3, line 6.8, safe 3.1: -((4.3 - 6.8) / 3.7)^2. Lane 7: -((3.5 - 6) / 2.9)^2.
    np.testing.assert_allclose(
        result.vehicle_reward[0], [-((2.5 / 3.7) ** 2), -((2.5 / 2.9) ** 2), 0.0]
    )
    assert result.total[0] == pytest.approx(-((2.5 / 2.9) ** 2))
    assert (result.critical_vehicle[0], result.critical_lane[0]) == (1, 1)


@pytest.mark.parametrize(("m", "expected"), [(-2.99, -0.25), (-3.0, 0.0), (-8.0, 0.0)])
def test_a_vehicle_that_has_left_is_safe(situation: Make, m: float, expected: float) -> None:
    gone = {"id": 1, "lane": 3, "m": m, "mps": 5.0}
    result = paper(situation([LANE], [gone], **BEHIND_LINE))
    assert result.total[0] == pytest.approx(expected)


def test_an_ego_that_has_left_is_safe(situation: Make) -> None:
    inside = {"id": 1, "lane": 3, "m": 0.0, "mps": 5.0}
    for ego_m, expected in ((-2.99, -1.0), (-3.0, 0.0)):
        s = situation([{"id": 3, "ego_m": ego_m}], [inside], stop_line_m=ego_m - 5.5)
        assert paper(s).total[0] == expected


def test_hidden_vehicles_count_only_if_asked_for(situation: Make) -> None:
    # At d_o = 20 with 7 m/s it reaches the zone in 17 / 7 s, the ego leaves in 3.12 s.
    s = situation([LANE | {"hidden_m": 20.0}], **BEHIND_LINE)
    assert paper(s).total[0] == 0.0
    result = assess(s, CONFIG, include_hidden=True)
    assert result.total[0] == pytest.approx(-0.25)
    assert (result.critical_vehicle[0], result.critical_lane[0]) == (-1, 0)
    assert paper(s).lane_reward[0, 0] == result.lane_reward[0, 0]


def test_a_hidden_vehicle_drives_at_the_limit_already(situation: Make) -> None:
    # 41 / 7 - 3.1198 = 2.7373 s: -((2.7373 - 3) / 2.9)^2; the stop condition gives -0.25.
    s = situation([LANE | {"hidden_m": 44.0}], **BEHIND_LINE)
    leave_s = np.sqrt(2.0 * 7.3 / 1.5)
    expected = -(((41.0 / 7.0 - leave_s - 3.0) / 2.9) ** 2)
    assert assess(s, CONFIG, include_hidden=True).total[0] == pytest.approx(expected)


def test_a_place_hidden_behind_the_zone_is_still_a_threat(situation: Make) -> None:
    # Even the zone itself is not seen: the virtual vehicle never counts as gone.
    s = situation([LANE | {"hidden_m": -5.0}], **BEHIND_LINE)
    assert assess(s, CONFIG, include_hidden=True).total[0] == pytest.approx(-0.25)


def test_lengths_of_zone_belong_to_their_own_side(situation: Make) -> None:
    # The lane's 10 m let the vehicle in at 5 m; the ego's zone of 4 m lets it stop up to 2.1 m.
    lane = {"id": 3, "ego_m": 2.5, "zone_m": 10.0, "ego_zone_m": 4.0}
    vehicle = {"id": 1, "lane": 3, "m": -4.9, "mps": 5.0}
    result = paper(situation([lane], [vehicle], stop_line_m=-2.0))
    assert result.total[0] == pytest.approx(-(((2.5 - 4.5) / 2.4) ** 2))


def test_of_equal_risks_the_first_to_arrive_is_critical(situation: Make) -> None:
    lanes = [{"id": 3, "ego_m": 1.0}]
    vehicles = [
        {"id": 4, "lane": 3, "m": 12.0, "mps": 5.0},
        {"id": 9, "lane": 3, "m": 8.0, "mps": 5.0},
        {"id": 2, "lane": 3, "m": 8.0, "mps": 5.0},
    ]
    result = assess(situation(lanes, vehicles, stop_line_m=-4.5), CONFIG, include_hidden=True)
    assert result.total[0] == -1.0
    assert result.critical_vehicle[0] == 2  # ids decide between 9 and 2


MERGE: dict[str, Any] = {"id": 5, "ego_m": 2.0, "zone_m": 10.0, "ego_zone_m": 20.0, "merging": True}
# The ego has 2 + 10 = 12 m to the join and stands in the zone: it cannot stop before it.


@pytest.mark.parametrize(
    ("m", "ego_mps", "expected"),
    [
        (-4.9, 0.0, -1.0),  # not yet through the join: the paper's two conditions
        (-5.1, 0.0, 0.0),  # through: 12.1 m ahead, leaves room for 5 m
        (-5.1, 5.0, -1.0),  # 12.1 + (9 - 25) / 7 = 9.8 m of centres at rest, see below
        (-5.1, 4.0, 0.0),
    ],
)
def test_a_vehicle_through_the_join_is_a_leader(
    situation: Make, m: float, ego_mps: float, expected: float
) -> None:
    config = RiskConfig(leader_margin_m=6.0)  # centres at least 10 m apart at rest
    vehicle = {"id": 1, "lane": 5, "m": m, "mps": 3.0}
    s = situation([MERGE], [vehicle], stop_line_m=-10.0, ego_mps=ego_mps)
    assert assess(s, config, include_hidden=False).total[0] == expected


def test_a_crossing_vehicle_as_far_on_is_gone(situation: Make) -> None:
    vehicle = {"id": 1, "lane": 5, "m": -5.1, "mps": 0.0}
    lane = MERGE | {"merging": False}
    assert paper(situation([lane], [vehicle], stop_line_m=-10.0, ego_mps=5.0)).total[0] == 0.0


def test_a_vehicle_behind_the_ego_on_the_common_path_is_no_leader(situation: Make) -> None:
    # The ego is 8 m past the join, the vehicle 1 m.
    lane = MERGE | {"ego_m": -18.0}
    vehicle = {"id": 1, "lane": 5, "m": -6.0, "mps": 7.0}
    assert paper(situation([lane], [vehicle], stop_line_m=-30.0, ego_mps=5.0)).total[0] == 0.0


def test_a_leader_stays_one_once_the_ego_has_joined(situation: Make) -> None:
    # Ego 8 m past the join, vehicle 12 m past it and standing: 4 m, footprints touch.
    lane = MERGE | {"ego_m": -18.0}
    vehicle = {"id": 1, "lane": 5, "m": -17.0, "mps": 0.0}
    assert paper(situation([lane], [vehicle], stop_line_m=-30.0)).total[0] == -1.0


def rewards(s: Situations) -> ActionRewards:
    """R_risk after 2 s of Stop, Slow and Fast."""
    return predict_actions(s, CONFIG, 2.0)


def test_predicted_hidden_vehicles_come_on_at_the_limit(situation: Make) -> None:
    # Fast from rest at the line: 3 m on at 3 m/s, 2.5 m before the centre; it leaves after
    # 4/3 s and 5.3333 m plus 0.1667 m at 5 m/s: 1.3667 s. The virtual vehicle is at d_o - 14.
    leave_s = 4.0 / 3.0 + (5.5 - 16.0 / 3.0) / 5.0
    for hidden_m in (47.0, 40.0):
        s = situation([{"id": 3, "ego_m": 5.5, "hidden_m": hidden_m}])
        gap_s = (hidden_m - 14.0 - 3.0) / 7.0 - leave_s
        expected = -((max(0.0, 3.0 - gap_s) / 2.9) ** 2)
        assert rewards(s).total[0, 2] == pytest.approx(expected)
        assert rewards(s).total[0, 0] == 0.0


def test_predicted_vehicles_accelerate_to_the_limit(situation: Make) -> None:
    # From 5 m/s: 1 s and 6 m to 7 m/s, then 7 m: 13 m in 2 s. Then (m - 16) / 7 s to the zone.
    leave_s = 4.0 / 3.0 + (5.5 - 16.0 / 3.0) / 5.0
    vehicle = {"id": 1, "lane": 3, "m": 40.0, "mps": 5.0}
    s = situation([{"id": 3, "ego_m": 5.5}], [vehicle])
    expected = -(((24.0 / 7.0 - leave_s - 3.0) / 2.9) ** 2)
    assert rewards(s).total[0, 2] == pytest.approx(expected)


@pytest.mark.parametrize(("mps", "gone"), [(3.9, False), (4.1, True)])
def test_predicted_vehicles_are_gone_only_if_they_leave_keeping_speed(
    situation: Make, mps: float, gone: bool
) -> None:
    # 8 m to leave in 2 s. Accelerating, both have left; a vehicle at 3.9 m/s need not.
    vehicle = {"id": 1, "lane": 3, "m": 5.0, "mps": mps}
    result = rewards(situation([{"id": 3, "ego_m": 5.5}], [vehicle]))
    assert result.total[0, 2] == (0.0 if gone else -1.0)
    assert result.critical_vehicle[0, 2] == (-1 if gone else 0)


def test_no_time_ahead_the_prediction_is_the_assessment(random_situations: Make) -> None:
    s = random_situations(seed=5, batch=200)
    now = assess(s, CONFIG, include_hidden=True)
    predicted = predict_actions(s, CONFIG, 0.0)
    for action in range(3):
        np.testing.assert_array_equal(predicted.total[:, action], now.total)
        np.testing.assert_array_equal(predicted.critical_vehicle[:, action], now.critical_vehicle)


def row(s: Situations, i: int) -> Situations:
    return Situations._make(field[i : i + 1] for field in s)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_a_row_of_a_batch_is_a_batch_of_one(random_situations: Make, seed: int, batch: int) -> None:
    s = random_situations(seed, batch)
    whole, ahead = assess(s, CONFIG, include_hidden=True), rewards(s)
    for i in range(batch):
        alone = assess(row(s, i), CONFIG, include_hidden=True)
        for one, many in zip((*alone, *rewards(row(s, i))), (*whole, *ahead), strict=True):
            np.testing.assert_array_equal(one[0], many[i])
    assert np.all((whole.total >= -1.0) & (whole.total <= 0.0))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_order_of_vehicles_changes_nothing(random_situations: Make, seed: int) -> None:
    s = random_situations(seed, 4)
    order = np.random.default_rng(seed).permutation(8)
    names = [name for name in s._fields if name.startswith("vehicle_")]
    mixed = s._replace(**{name: getattr(s, name)[:, order].copy() for name in names})
    here, there = assess(s, CONFIG, include_hidden=True), assess(mixed, CONFIG, include_hidden=True)
    np.testing.assert_array_equal(here.total, there.total)
    np.testing.assert_array_equal(here.critical_lane, there.critical_lane)
    places = there.critical_vehicle
    np.testing.assert_array_equal(here.critical_vehicle, np.where(places < 0, -1, order[places]))
