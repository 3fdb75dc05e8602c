# SPDX-License-Identifier: Apache-2.0
"""What goes out in words agrees with the fields beside it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from risk_dqn_planner.decision import Action, Decision, Reason, explain, fault_decision, text_of
from risk_dqn_planner.explanation.fields import NOTHING_EXPLAINED
from risk_dqn_planner.policies.base import Decisions, StopsAtGoal
from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.rule_based import RuleBasedConfig, RuleBasedPolicy
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.situation.situations import Situations
from risk_dqn_planner.vehicle import EgoLimits

Make = Callable[..., Situations]
LANE: dict[str, Any] = {"id": 12, "ego_m": 5.5}


def by_rule(s: Situations) -> Decision:
    policy = StopsAtGoal(RuleBasedPolicy())
    return explain(policy.decide(s, np.ones(1, dtype=bool)), s, 0, policy)


def test_a_clear_road(situation: Make) -> None:
    decision = by_rule(situation())
    assert decision.text == "FAST: no conflict within range"
    assert (decision.action, decision.target_speed_mps) == (Action.FAST, 5.0)
    assert decision.reason is Reason.CLEAR
    assert (decision.critical_vehicle_id, decision.critical_lane_id) == (None, None)
    assert decision.policy_name == "rule_based"
    assert len(decision.policy_hash) == 64


def test_a_lane_that_is_seen_far_enough(situation: Make) -> None:
    # Beyond 70 m less half a zone somebody would need 67 / 7 s; the ego leaves after 4.5 s, with
    # 3.33 s to reach 5 m/s on 8.33 m and 0.17 m to go.
    decision = by_rule(situation([LANE]))
    assert decision.text == (
        "FAST: lane 12 is hidden beyond 70.0 m, a vehicle there arrives in 9.6 s, "
        "leaving takes 3.4 s"
    )
    assert decision.reason is Reason.CLEAR
    assert (decision.critical_vehicle_id, decision.critical_lane_id) == (None, 12)


def test_a_vehicle_that_forbids_to_go(situation: Make) -> None:
    # 21 m to the zone at 7 m/s; the ego leaves 2.4246 s after 2 s of Slow.
    decision = by_rule(situation([LANE], [{"id": 17, "lane": 12, "m": 24.0, "mps": 7.0}]))
    assert decision.text == (
        "STOP: vehicle 17 reaches conflict zone of lane 12 in 3.0 s, "
        "leaving takes 4.4 s with SLOW (gap wanted 3.0 s)"
    )
    assert (decision.action, decision.target_speed_mps) == (Action.STOP, 0.0)
    assert decision.reason is Reason.VEHICLE
    assert (decision.critical_vehicle_id, decision.critical_lane_id) == (17, 12)


def test_a_vehicle_in_the_zone(situation: Make) -> None:
    decision = by_rule(situation([LANE], [{"id": 17, "lane": 12, "m": 2.0, "mps": 0.0}]))
    assert decision.text.startswith(
        "STOP: vehicle 17 is in conflict zone of lane 12, leaving takes 4.4 s with SLOW"
    )


def test_a_lane_that_may_hide_a_vehicle(situation: Make) -> None:
    # Slow is possible 12 m before the line; Fast would leave after 2 s and 10 m and then
    # another 7.5 + 3 m at 5 m/s.
    s = situation([{"id": 12, "ego_m": 17.5, "hidden_m": 18.25}], stop_line_m=12.0, ego_mps=5.0)
    decision = by_rule(s)
    assert decision.text == (
        "SLOW: lane 12 is hidden beyond 18.2 m, a vehicle there arrives in 2.2 s, "
        "leaving takes 4.1 s with FAST (gap wanted 3.0 s)"
    )
    assert (decision.action, decision.target_speed_mps) == (Action.SLOW, 1.0)
    assert decision.reason is Reason.HIDDEN_VEHICLE
    assert (decision.critical_vehicle_id, decision.critical_lane_id) == (None, 12)
    assert decision.action_risks[Action.SLOW] == 0.0
    assert decision.action_risks[Action.FAST] > 0.0


def test_a_leader_on_a_merging_lane(situation: Make) -> None:
    # The ego is 1 m before the join, the leader 8 m past it.
    lane = {"id": 12, "ego_m": -9.0, "ego_zone_m": 20.0, "zone_m": 20.0, "merging": True}
    s = situation([lane], [{"id": 4, "lane": 12, "m": -18.0, "mps": 0.5}], ego_mps=3.0)
    assert by_rule(s).text == (
        "SLOW: vehicle 4 from lane 12 drives 9.0 m ahead at 0.5 m/s, too close for FAST"
    )


def test_the_goal(situation: Make) -> None:
    decision = by_rule(situation([LANE], goal_m=0.0))
    assert decision.text == "STOP: the goal is reached"
    assert decision.reason is Reason.GOAL_REACHED


def test_a_constant_policy(situation: Make) -> None:
    policy, s = ConstantPolicy(Action.SLOW), situation([LANE])
    decision = explain(policy.decide(s, np.ones(1, dtype=bool)), s, 0, policy)
    assert decision.text == "SLOW: the policy always decides so"
    assert decision.target_speed_mps == 1.0


def learned(s: Situations, critical: int) -> Decision:
    decisions = Decisions(
        action=np.array([Action.SLOW]),
        q_values=np.array([[-0.25, 0.5, 0.125]]),
        action_risks=np.array([[0.0, 0.0, 0.5]]),
        reason=np.array([Reason.LEARNED]),
        critical_vehicle=np.array([critical]),
        critical_lane=np.array([critical]),
    )
    return explain(decisions, s, 0, ConstantPolicy(Action.SLOW))


def test_a_network_tells_its_lead_and_what_it_risks(situation: Make) -> None:
    s = situation([LANE], [{"id": 17, "lane": 12, "m": 24.0, "mps": 7.0}])
    lead = "SLOW: rated 0.38 above FAST; vehicle 17 reaches conflict zone of lane 12 in 3.0 s, "
    assert learned(s, critical=-1).text.startswith(lead)
    assert learned(s, critical=0).text.startswith(lead)
    np.testing.assert_array_equal(learned(s, critical=0).q_values, [-0.25, 0.5, 0.125])


def test_limits_of_the_configuration_reach_the_words(situation: Make) -> None:
    config = RuleBasedConfig(risk=RiskConfig(desired_gap_s=4.0, ego=EgoLimits(slow_mps=2.0)))
    policy = RuleBasedPolicy(config)
    s = situation([{"id": 12, "ego_m": 17.5, "hidden_m": 18.0}], stop_line_m=12.0, ego_mps=5.0)
    decision = explain(policy.decide(s, np.ones(1, dtype=bool)), s, 0, policy, config)
    assert decision.target_speed_mps == 2.0
    assert "gap wanted 4.0 s" in decision.text


def test_one_of_a_batch_is_explained(random_situations: Make) -> None:
    s, policy = random_situations(seed=4, batch=100), RuleBasedPolicy()
    decisions = policy.decide(s, np.ones(100, dtype=bool))
    for i in range(100):
        decision = explain(decisions, s, i, policy)
        assert decision.text.startswith(decision.action.name)
        vehicle, lane = decision.critical_vehicle_id, decision.critical_lane_id
        assert (f"vehicle {vehicle} " in decision.text) == (vehicle is not None)
        assert (f"lane {lane}" in decision.text) == (lane is not None)
        assert decision.text == text_of(decision)


@pytest.mark.parametrize("reason", [Reason.MISSING_INPUT, Reason.POLICY_FAILED])
def test_a_fault_is_answered_with_stop(reason: Reason) -> None:
    decision = fault_decision(reason, "nothing received yet", "rule_based", "abc")
    assert (decision.action, decision.target_speed_mps) == (Action.STOP, 0.0)
    assert decision.text == "STOP: nothing received yet"
    assert decision.reason is reason
    assert decision.explanation == NOTHING_EXPLAINED
    assert np.isnan(decision.q_values).all()
    assert np.isnan(decision.action_risks).all()
    assert (decision.policy_name, decision.policy_hash) == ("rule_based", "abc")
