# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.situation.situations import Situations, empty_situations
from sim_bridge.environment.rewards import reward_named, rewards


def situation(
    ego_speed_mps: float, ego_distance_m: float, vehicle: bool, hidden_distance_m: float = 70.0
) -> Situations:
    """One crossing 6 m long, the stop line 6 m before its centre, perhaps a vehicle 10 m off."""
    s = empty_situations(1, 1, 1)
    s.ego_speed_mps[:] = ego_speed_mps
    s.stop_line_distance_m[:] = ego_distance_m - 6.0
    s.goal_distance_m[:] = ego_distance_m + 20.0
    s.lane_mask[:] = True
    s.lane_ego_distance_m[:] = ego_distance_m
    s.lane_ego_zone_m[:] = s.lane_zone_m[:] = 6.0
    s.lane_hidden_distance_m[:] = hidden_distance_m
    s.lane_speed_limit_mps[:] = 7.0
    s.vehicle_mask[:] = vehicle
    s.vehicle_distance_m[:] = 10.0
    s.vehicle_speed_mps[:] = 7.0
    return s


def reward(
    name: str,
    s: Situations,
    collided: bool = False,
    at_goal: bool = False,
    switched: bool = False,
    hard_braked: bool = False,
) -> float:
    how = (np.array([each]) for each in (collided, at_goal, switched, hard_braked))
    return float(rewards(reward_named(name), RiskConfig(), s, *how)[0])


def test_risk_pays_a_fifth_of_the_share_of_top_speed_where_all_is_safe() -> None:
    assert reward("risk", situation(2.5, 40.0, vehicle=True)) == pytest.approx(0.2 * 0.5)


def test_risk_takes_four_fifths_where_the_ego_can_neither_stop_nor_leave_first() -> None:
    # 4 m before the centre at 5 m/s: braking takes 3.57 m, so rest is at 0.43 m < 3.1 m. The ego
    # leaves after 7 m, 1.4 s; the vehicle reaches the zone after 7 m at 7 m/s, 1.0 s.
    s = situation(5.0, 4.0, vehicle=True)
    assert reward("risk", s) == pytest.approx(-0.8 + 0.2)


def test_hidden_vehicles_count_only_where_the_reward_says_so() -> None:
    s = situation(5.0, 4.0, vehicle=False, hidden_distance_m=10.0)
    assert reward("risk", s) == pytest.approx(0.2)
    assert reward("risk_with_occlusions", s) == pytest.approx(-0.8 + 0.2)


def test_risk_rewards_know_no_events() -> None:
    s = situation(2.5, 40.0, vehicle=False)
    for name in ("risk", "risk_with_occlusions"):
        assert reward(name, s, collided=True) == reward(name, s, at_goal=True) == reward(name, s)


def test_collision_pays_for_events_alone() -> None:
    s = situation(5.0, 4.0, vehicle=True)
    assert reward("collision", s, collided=True) == -2.0
    assert reward("collision", s, at_goal=True) == 1.0
    assert reward("collision", s) == pytest.approx(-0.00001)


def test_progress_pays_for_time_for_switching_and_for_hard_braking() -> None:
    s = situation(5.0, 4.0, vehicle=True)
    assert reward("progress", s) == pytest.approx(-0.01)
    assert reward("progress", s, switched=True) == pytest.approx(-0.06)
    assert reward("progress", s, switched=True, hard_braked=True) == pytest.approx(-0.09)
    assert reward("progress", s, at_goal=True) == 1.0


def test_joint_risk_is_progress_and_some_of_the_risk() -> None:
    # Risk -1 as above: where the ego can neither stop nor leave first.
    s = situation(5.0, 4.0, vehicle=True)
    assert reward("joint_risk", s, switched=True) == pytest.approx(-0.06 - 0.02)
    assert reward("collision", s, switched=True) == reward("collision", s)


def test_an_unknown_reward_is_refused_by_name() -> None:
    with pytest.raises(ConfigurationError, match="no reward 'comfort', expected one of: arrival"):
        reward_named("comfort")
