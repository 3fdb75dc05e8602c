# SPDX-License-Identifier: Apache-2.0
"""The joint check at merging lanes, worked out by hand.

Footprints are 4 m long; a follower accelerates for 1 s with up to 7 m/s, then brakes with
2 m/s^2, and wants 2 m; leaders brake with 8 m/s^2, and 1 m must remain behind them. Both zones
are 6 m long, so that a vehicle at d is d - ego_m behind the ego on the common path.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.course import BRAKE, GO
from risk_dqn_planner.safety.joint_check import JointCheck, joint_check
from risk_dqn_planner.safety.known import at_first_sight
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
FAR = 200.0


def merging(ego_m: float, hidden_m: float = FAR) -> dict[str, Any]:
    return {"id": 3, "ego_m": ego_m, "hidden_m": hidden_m, "merging": True}


def check(s: Situations, reacted_m: float = -np.inf, **changes: Any) -> JointCheck:  # noqa: ANN401
    assumptions = SafetyAssumptions(**changes)
    known = at_first_sight(s, assumptions.numbers())._replace(reacted_m=np.array([[reacted_m]]))
    return joint_check(s, assumptions, None, known)


@pytest.mark.parametrize(("hidden_m", "expected"), [(23.6, True), (23.5, False)])
def test_a_hidden_follower_needs_room_to_react_and_brake(
    situation: Make, hidden_m: float, expected: bool
) -> None:
    # From rest 0.15 m before the zone the ego is in it after 0.4472 s; 1 s later it has come
    # 1.5708 m and has 2.1708 m/s. Coming with 7 m/s the other has covered 10.1304 m by then and
    # must still lose 4.8292 m/s: 5.8303 m. 10.1304 + 5.8303 + 6 - 1.5708 + 3.15 = 23.54 m.
    result = check(situation([merging(3.15, hidden_m)]))
    assert result.admissible[0].tolist() == [True, expected, expected]
    assert result.periods[0, Action.FAST] == (GO if expected else -1)
    assert result.critical_lane[0, Action.FAST] == 0


@pytest.mark.parametrize(("behind_m", "go"), [(9.05, True), (8.95, False)])
def test_9_m_behind_are_enough_if_the_ego_need_not_brake(
    situation: Make, behind_m: float, go: bool
) -> None:
    # At 5 m/s just inside: 2 m are lost in the reaction, 1 m to lose 2 m/s, 6 m of room.
    follower = {"id": 8, "lane": 3, "m": 2.9 + behind_m, "mps": 7.0}
    result = check(situation([merging(2.9)], [follower], ego_mps=5.0))
    assert result.admissible[0].tolist() == [False, False, go]


@pytest.mark.parametrize(("behind_m", "brake"), [(21.7, True), (21.65, False)])
def test_22_m_behind_are_enough_if_it_brakes_to_rest(
    situation: Make, behind_m: float, brake: bool
) -> None:
    # 7 m in the reaction, 12.25 m to come to rest, 6 m of room, less the ego's own 3.571 m.
    follower = {"id": 8, "lane": 3, "m": 2.9 + behind_m, "mps": 7.0}
    result = check(situation([merging(2.9)], [follower], ego_mps=5.0))
    assert (result.periods[0, Action.STOP] == BRAKE) == brake


def test_a_follower_that_has_seen_the_ego_for_long_does_not_accelerate_again(
    situation: Make,
) -> None:
    # Both at rest, 1.9 m apart: less than a driver would take at entering, but it stands.
    follower = {"id": 8, "lane": 3, "m": 8.9, "mps": 0.0}
    s = situation([merging(3.0 - 0.1)], [follower | {"m": 2.9 + 5.9}])
    assert not check(s).admissible.any()
    assert check(s, reacted_m=10.0).admissible.all()
    assert not check(s, reacted_m=8.0).admissible.any()


@pytest.mark.parametrize(("ahead_m", "expected"), [(10.1, True), (10.05, False)])
def test_the_ego_can_stop_behind_its_leader(
    situation: Make, ahead_m: float, expected: bool
) -> None:
    # Fast for 0.5 s and braking take 6.071 m. From 4 m/s the leader rests after 1 m; 5 m of room.
    leader = {"id": 8, "lane": 3, "m": -5.0 - ahead_m, "mps": 4.0}
    result = check(situation([merging(-5.0)], [leader], ego_mps=5.0))
    assert result.admissible[0].tolist() == [True, True, expected]
    assert result.critical_vehicle[0, Action.FAST] == 0


def test_a_slower_leader_is_assumed_where_its_speed_is_uncertain(situation: Make) -> None:
    leader = {"id": 8, "lane": 3, "m": -15.1, "mps": 4.0}
    s = situation([merging(-5.0)], [leader], ego_mps=5.0)
    assert check(s).admissible[0, Action.FAST]
    assert not check(s, speed_error_mps=0.2).admissible[0, Action.FAST]
    assert not check(s, position_error_m=0.1).admissible[0, Action.FAST]


def test_a_leader_forbids_going_for_ever_but_not_going_through(situation: Make) -> None:
    # A leader at rest 12 m ahead of an ego that stands 0.15 m before the zone, which is also that
    # of a crossing lane. After 2.5 s of going and braking the ego rests 6.70 m further, behind
    # the zone, and 7 m are left to it.
    leader = {"id": 8, "lane": 3, "m": 3.15 - 12.0, "mps": 0.0}
    crossing = {"id": 4, "ego_m": 3.15, "hidden_m": FAR}
    result = joint_check(situation([merging(3.15), crossing], [leader]), SafetyAssumptions())
    assert result.admissible.all()
    assert result.periods[0, Action.FAST] == 4


def test_with_a_leader_a_follower_needs_the_room_of_braking(situation: Make) -> None:
    # 15 m behind do for going on, but not for braking; a leader may force the ego to.
    follower = {"id": 8, "lane": 3, "m": 2.9 + 15.0, "mps": 7.0}
    leader = {"id": 9, "lane": 3, "m": 2.9 - 9.0, "mps": 5.0}
    alone = check(situation([merging(2.9)], [follower], ego_mps=5.0))
    assert alone.admissible[0, Action.FAST]
    both = check(situation([merging(2.9)], [follower, leader], ego_mps=5.0))
    assert not both.admissible.any()


def test_at_rest_before_the_zone_but_within_its_margin_is_no_place_to_be(situation: Make) -> None:
    # 0.05 m before the zone: as at a crossing.
    crossing = {"id": 3, "ego_m": 3.05, "hidden_m": 4.0}
    assert not check(situation([crossing])).admissible.any()
    assert not check(situation([crossing | {"merging": True}])).admissible.any()
