# SPDX-License-Identifier: Apache-2.0
from collections.abc import Callable

import numpy as np
import pytest

from risk_dqn_planner.policies.base import Action, Reason, StopsAtGoal
from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.rule_based import RuleBasedPolicy
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]


@pytest.mark.parametrize("action", list(Action))
def test_constant_policies_never_change(random_situations: Make, action: Action) -> None:
    policy = ConstantPolicy(action)
    decisions = policy.decide(random_situations(seed=1, batch=20), np.ones(20, dtype=bool))
    assert policy.name == f"always_{action.name.lower()}"
    assert set(decisions.action) == {action}
    assert set(decisions.reason) == {Reason.FIXED}
    assert np.isnan(decisions.action_risks).all()


def test_constant_policies_have_hashes_of_their_own() -> None:
    assert len({ConstantPolicy(action).hash for action in Action}) == 3


@pytest.mark.parametrize(("goal_m", "reached"), [(0.01, False), (0.0, True), (-3.0, True)])
def test_behind_the_goal_every_policy_stops(situation: Make, goal_m: float, reached: bool) -> None:
    policy = StopsAtGoal(ConstantPolicy(Action.FAST))
    decisions = policy.decide(situation(goal_m=goal_m), np.ones(1, dtype=bool))
    assert decisions.action[0] == (Action.STOP if reached else Action.FAST)
    assert decisions.reason[0] == (Reason.GOAL_REACHED if reached else Reason.FIXED)


def test_at_the_goal_nothing_is_critical_and_other_rows_stay(random_situations: Make) -> None:
    s = random_situations(seed=3, batch=200)
    restart = np.ones(200, dtype=bool)
    inner, outer = RuleBasedPolicy(), StopsAtGoal(RuleBasedPolicy())
    plain, stopped = inner.decide(s, restart), outer.decide(s, restart)
    at_goal = s.goal_distance_m <= 0.0
    assert at_goal.any()
    assert (plain.critical_lane[at_goal] >= 0).any()
    assert (stopped.critical_lane[at_goal] == -1).all()
    assert (stopped.critical_vehicle[at_goal] == -1).all()
    for before, after in zip(plain, stopped, strict=True):
        if before is None or after is None:
            assert before is after
            continue
        np.testing.assert_array_equal(before[~at_goal], after[~at_goal])
    assert (outer.name, outer.hash) == (inner.name, inner.hash)
