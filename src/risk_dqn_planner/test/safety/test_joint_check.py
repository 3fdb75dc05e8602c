# SPDX-License-Identifier: Apache-2.0
"""The joint check at crossing lanes, in situations worked out by hand.

The ego accelerates with 1.5 m/s^2 to 5 m/s, brakes with 3.5 m/s^2 and decides every 0.5 s; zones
are 6 m long on both sides; 0.1 s and 0.1 m are the margins. From rest one period of going takes
the ego 0.1875 m and leaves it 0.0804 m of braking.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.course import BRAKE, GO
from risk_dqn_planner.safety.joint_check import JointCheck, joint_check
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
AT_THE_ZONE: dict[str, Any] = {"id": 3, "ego_m": 3.15}  # 0.15 m before it, too near to move on
ALL, NONE, STOP_ONLY = [True, True, True], [False, False, False], [True, False, False]


def check(s: Situations, **changes: Any) -> JointCheck:  # noqa: ANN401
    return joint_check(s, replace(SafetyAssumptions(), **changes))


def admissible(s: Situations, **changes: Any) -> list[bool]:  # noqa: ANN401
    return [bool(value) for value in check(s, **changes).admissible[0]]


def test_without_lanes_everything_is_admissible(situation: Make) -> None:
    result = check(situation())
    assert result.admissible.all()
    assert (result.margin_s == np.inf).all()


def test_far_before_the_zone_braking_vindicates_every_action(situation: Make) -> None:
    # Something may stand in the zone for ever; the ego rests 0.2679 m further, 2.2 m before it.
    result = check(situation([{"id": 3, "ego_m": 5.5, "hidden_m": -3.0}]))
    assert result.admissible[0].tolist() == ALL
    assert (result.periods == BRAKE).all()


@pytest.mark.parametrize(("hidden_m", "expected"), [(23.8, ALL), (23.7, STOP_ONLY)])
def test_who_enters_must_have_left_before_a_hidden_vehicle_comes(
    situation: Make, hidden_m: float, expected: list[bool]
) -> None:
    # 6.15 m from rest take sqrt(2 * 6.15 / 1.5) = 2.8636 s; 0.1 s later the hidden vehicle has
    # come 7 * 2.9636 = 20.745 m nearer, to half a zone before the centre.
    result = check(situation([AT_THE_ZONE | {"hidden_m": hidden_m}]))
    assert result.admissible[0].tolist() == expected
    assert result.periods[0, Action.FAST] == (GO if expected == ALL else -1)
    assert result.margin_s[0, Action.FAST] == pytest.approx(
        (hidden_m - 3.0) / 7.0 - 2.963564, abs=1e-6
    )
    assert (result.critical_vehicle[0, Action.FAST], result.critical_lane[0, Action.FAST]) == (
        -1,
        0,
    )


@pytest.mark.parametrize(("mps", "m"), [(7.0, 23.745), (5.0, 22.745), (9.0, 29.672)])
def test_a_seen_vehicle_may_accelerate_to_the_limit_but_keeps_a_higher_speed(
    situation: Make, mps: float, m: float
) -> None:
    # At 5 m/s: 1 s and 6 m to reach 7 m/s, then 13.745 m in the remaining 1.9636 s. 9 m/s stay.
    def at(distance_m: float) -> JointCheck:
        return check(situation([AT_THE_ZONE], [{"id": 8, "lane": 3, "m": distance_m, "mps": mps}]))

    assert at(m + 0.01).admissible[0].tolist() == ALL
    nearer = at(m - 0.01)
    assert nearer.admissible[0].tolist() == STOP_ONLY
    assert (nearer.critical_vehicle[0, Action.FAST], nearer.critical_lane[0, Action.FAST]) == (0, 0)


def test_only_a_vehicle_that_has_left_its_zone_is_gone(situation: Make) -> None:
    def behind(m: float) -> list[bool]:
        return admissible(situation([AT_THE_ZONE], [{"id": 8, "lane": 3, "m": m, "mps": 5.0}]))

    assert behind(-2.99) == STOP_ONLY
    assert behind(-3.0) == ALL


def test_an_unseen_exit_may_be_occupied(situation: Make) -> None:
    assert admissible(situation([AT_THE_ZONE | {"hidden_m": -3.0}])) == STOP_ONLY


def test_conditions_that_hold_for_each_lane_alone_need_not_hold_together(situation: Make) -> None:
    # At 3 m/s, 1 m before lane 1 (braking takes 1.286 m) and 4.5 m before lane 2, where someone
    # stands. Lane 1 would be left after 1.667 s, its vehicle comes after 4 s. But whoever stops
    # before lane 2 stands in lane 1.
    lanes = [{"id": 1, "ego_m": 4.0}, {"id": 2, "ego_m": 7.5}]
    coming = {"id": 8, "lane": 1, "m": 31.0, "mps": 7.0}
    standing = {"id": 9, "lane": 2, "m": 0.0, "mps": 0.0}
    assert admissible(situation(lanes[:1], [coming], ego_mps=3.0))[Action.FAST]
    assert admissible(situation(lanes[1:], [standing], ego_mps=3.0))[Action.STOP]
    assert admissible(situation(lanes, [coming], ego_mps=3.0))[Action.FAST]
    assert admissible(situation(lanes, [coming, standing], ego_mps=3.0)) == NONE


@pytest.mark.parametrize(("coming_m", "expected"), [(6.92, True), (6.85, False)])
def test_the_ego_may_rest_between_two_zones_if_it_leaves_the_first_in_time(
    situation: Make, coming_m: float, expected: bool
) -> None:
    # Braking from 3 m/s leaves lane 1, 1 m ahead, after 2 / (3 + sqrt(2)) = 0.4531 s and rests
    # 0.286 m behind it; lane 2 is occupied.
    lanes = [{"id": 1, "ego_m": -2.0}, {"id": 2, "ego_m": 10.0}]
    vehicles = [
        {"id": 8, "lane": 1, "m": coming_m, "mps": 7.0},
        {"id": 9, "lane": 2, "m": 0.0, "mps": 0.0},
    ]
    result = check(situation(lanes, vehicles, ego_mps=3.0))
    assert result.admissible[0, Action.STOP] == expected
    assert result.periods[0, Action.STOP] == (BRAKE if expected else -1)


def test_going_for_a_while_and_then_resting_between_zones_is_a_manoeuvre_too(
    situation: Make,
) -> None:
    # Lane 1 is 0.15 m ahead and 6.15 m long from here, lane 2, where someone stands, begins at
    # 12 m. Going for 2 s and half the next: the ego must rest between 6.25 and 11.9 m.
    lanes = [AT_THE_ZONE, {"id": 2, "ego_m": 15.0}]
    standing = [{"id": 9, "lane": 2, "m": 0.0, "mps": 0.0}]
    result = check(situation(lanes, standing))
    assert result.admissible[0].tolist() == ALL
    # After n + 1 periods: 0.75 t^2 + (1.5 t)^2 / 7 = 1.0714 t^2 is 6.6964 m at 2.5 s, 4.29 at 2 s.
    assert result.periods[0, Action.FAST] == 4


def test_the_action_itself_counts_not_only_what_follows(situation: Make) -> None:
    # 0.05 m before the zone at 1 m/s: Stop still enters it by 0.09 m, whatever comes after.
    s = situation([{"id": 3, "ego_m": 3.05, "hidden_m": -3.0}], ego_mps=1.0)
    assert admissible(s) == NONE


def test_an_error_of_speed_counts_as_speed(situation: Make) -> None:
    # Measured 4 m/s may be 7 m/s: 23.745 m as above.
    for m, expected in ((23.76, ALL), (23.73, STOP_ONLY)):
        s = situation([AT_THE_ZONE], [{"id": 8, "lane": 3, "m": m, "mps": 4.0}])
        assert admissible(s, speed_error_mps=3.0) == expected
        assert admissible(s) == ALL


def test_an_error_of_position_counts_as_nearness(situation: Make) -> None:
    coming = situation([AT_THE_ZONE], [{"id": 8, "lane": 3, "m": 24.0, "mps": 7.0}])
    assert admissible(coming, position_error_m=0.2) == ALL
    assert admissible(coming, position_error_m=0.3) == STOP_ONLY
    leaving = situation([AT_THE_ZONE], [{"id": 8, "lane": 3, "m": -3.1, "mps": 7.0}])
    assert admissible(leaving, position_error_m=0.05) == ALL
    assert admissible(leaving, position_error_m=0.2) == STOP_ONLY


def test_a_lower_speed_ascribed_to_the_hidden_accepts_risk(situation: Make) -> None:
    s = situation([AT_THE_ZONE | {"hidden_m": 12.0}])
    assert admissible(s) == STOP_ONLY
    # 9 m at 3 m/s take 3 s.
    assert admissible(s, hidden_top_speed_mps=3.0) == ALL
    assert admissible(s, hidden_top_speed_mps=3.1) == STOP_ONLY
    assert admissible(s, hidden_top_speed_mps=0.0) == ALL
    occupied = situation([AT_THE_ZONE | {"hidden_m": 2.0}])
    assert admissible(occupied, hidden_top_speed_mps=0.0) == STOP_ONLY


def test_others_may_exceed_the_limit_by_a_factor(situation: Make) -> None:
    s = situation([AT_THE_ZONE | {"hidden_m": 26.0}])
    assert admissible(s) == ALL
    assert admissible(s, speed_limit_factor=1.2) == STOP_ONLY


def test_during_the_delay_the_action_before_stays_in_force(situation: Make) -> None:
    # At 2 m/s, 1.5 m before an occupied zone. Braking takes 0.571 m; after 0.4 s of Fast it
    # takes 0.92 + 2.6^2 / 7 = 1.886 m, after 0.4 s of Stop just the same 0.571 m.
    s = situation([{"id": 3, "ego_m": 4.5, "hidden_m": -3.0}], ego_mps=2.0)
    delayed = SafetyAssumptions(actuation_delay_s=0.4)
    assert joint_check(s, delayed, np.array([Action.STOP])).admissible[0, Action.STOP]
    assert not joint_check(s, delayed, np.array([Action.FAST])).admissible[0, Action.STOP]
    assert joint_check(s, SafetyAssumptions(), np.array([Action.FAST])).admissible[0, Action.STOP]


def test_a_batch_is_the_same_as_its_rows(random_situations: Make) -> None:
    batch = random_situations(3, 200)
    together = joint_check(batch, SafetyAssumptions())
    for row in range(200):
        one = Situations._make(field[row : row + 1] for field in batch)
        for alone, all_ in zip(joint_check(one, SafetyAssumptions()), together, strict=True):
            np.testing.assert_array_equal(alone[0], all_[row])
    assert 0.1 < together.admissible.mean() < 0.95


crossings: st.SearchStrategy[dict[str, Any]] = st.builds(
    dict,
    ego_m=st.floats(0.0, 20.0),
    hidden_m=st.floats(-3.0, 70.0),
    limit_mps=st.floats(3.0, 14.0),
)
vehicles_on_lanes: st.SearchStrategy[dict[str, Any]] = st.builds(
    dict, lane=st.integers(0, 2), m=st.floats(-2.9, 70.0), mps=st.floats(0.0, 12.0)
)


@settings(max_examples=300, deadline=None)
@given(
    lanes=st.lists(crossings, min_size=3, max_size=3),
    vehicles=st.lists(vehicles_on_lanes, min_size=1, max_size=4),
    ego_mps=st.floats(0.0, 5.0),
    nearer_m=st.floats(0.0, 20.0),
    faster_mps=st.floats(0.0, 5.0),
)
def test_nearer_and_faster_others_never_make_an_action_admissible(
    situation: Make,
    lanes: list[dict[str, float]],
    vehicles: list[dict[str, float]],
    ego_mps: float,
    nearer_m: float,
    faster_mps: float,
) -> None:
    lanes = [lane | {"id": k} for k, lane in enumerate(lanes)]
    there = [vehicle | {"id": 10 + k} for k, vehicle in enumerate(vehicles)]
    before = check(situation(lanes, there, ego_mps=ego_mps))
    # Nearer, but not beyond the zone: then it would be gone.
    worse = [
        vehicle | {"m": max(vehicle["m"] - nearer_m, -2.9), "mps": vehicle["mps"] + faster_mps}
        for vehicle in there
    ]
    hidden = [lane | {"hidden_m": max(lane["hidden_m"] - nearer_m, -3.0)} for lane in lanes]
    for s in (situation(lanes, worse, ego_mps=ego_mps), situation(hidden, there, ego_mps=ego_mps)):
        assert not (check(s).admissible & ~before.admissible).any()


@settings(max_examples=300, deadline=None)
@given(
    lanes=st.lists(crossings, min_size=3, max_size=3),
    vehicles=st.lists(vehicles_on_lanes, max_size=4),
    ego_mps=st.floats(0.0, 5.0),
)
def test_what_is_jointly_admissible_is_so_for_every_lane_alone(
    situation: Make,
    lanes: list[dict[str, float]],
    vehicles: list[dict[str, float]],
    ego_mps: float,
) -> None:
    lanes = [lane | {"id": k} for k, lane in enumerate(lanes)]
    s = situation(
        lanes, [vehicle | {"id": 10 + k} for k, vehicle in enumerate(vehicles)], ego_mps=ego_mps
    )
    together = check(s).admissible
    for lane in range(3):
        alone = s._replace(lane_mask=s.lane_mask & (np.arange(3) == lane))
        assert not (together & ~check(alone).admissible).any()
