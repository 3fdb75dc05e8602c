# SPDX-License-Identifier: Apache-2.0
"""Algorithm 1 in situations worked out by hand.

At rest at the stop line, 5.5 m before a crossing of 6 m: after 2 s of Fast the ego is 2.5 m
before the centre at 3 m/s and leaves 1.3667 s later; after 2 s of Slow it is 3.8333 m before it
at 1 m/s and leaves 2.4246 s later. A virtual vehicle at 7 m/s comes 14 m nearer meanwhile.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Action, Decisions, Reason
from risk_dqn_planner.policies.rule_based import RuleBasedConfig, RuleBasedPolicy, foresee
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
LANE: dict[str, Any] = {"id": 3, "ego_m": 5.5}


def decide(s: Situations) -> Decisions:
    return RuleBasedPolicy().decide(s, np.ones(s.ego_speed_mps.shape, dtype=bool))


def chosen(decisions: Decisions) -> tuple[Action, Reason, int, int]:
    return (
        Action(int(decisions.action[0])),
        Reason(int(decisions.reason[0])),
        int(decisions.critical_vehicle[0]),
        int(decisions.critical_lane[0]),
    )


def test_without_conflicts_it_goes_fast(situation: Make) -> None:
    assert chosen(decide(situation())) == (Action.FAST, Reason.CLEAR, -1, -1)


def test_it_crosses_when_the_lane_is_seen_far_enough(situation: Make) -> None:
    # (d_o - 14 - 3) / 7 - 1.3667 >= 3 holds from d_o = 47.57 m on.
    s = situation([LANE | {"hidden_m": 47.6}])
    assert chosen(decide(s)) == (Action.FAST, Reason.CLEAR, -1, -1)


def test_it_freezes_at_the_line_when_the_lane_is_hidden_nearer(situation: Make) -> None:
    # Slow would need (d_o - 17) / 7 - 2.4246 >= 3, d_o = 54.97 m.
    s = situation([LANE | {"hidden_m": 47.5}])
    assert chosen(decide(s)) == (Action.STOP, Reason.HIDDEN_VEHICLE, -1, 0)


@pytest.mark.parametrize(("sensor_range_m", "action"), [(40.0, Action.STOP), (60.0, Action.FAST)])
def test_at_40_m_it_freezes_and_at_60_m_it_crosses_as_in_the_paper(
    situation: Make, sensor_range_m: float, action: Action
) -> None:
    assert decide(situation([LANE | {"hidden_m": sensor_range_m}])).action[0] == action


def test_it_slows_down_while_it_can_still_stop_before_the_line(situation: Make) -> None:
    # At 5 m/s, 12 m before the line. Fast: 2 m left of the 3.57 m it needs. Slow brakes to
    # 1 m/s and covers 4.29 m. The virtual vehicle is too near to leave before it.
    s = situation(
        [{"id": 3, "ego_m": 17.5, "hidden_m": 30.0}], stop_line_m=12.0, goal_m=34.0, ego_mps=5.0
    )
    decisions = decide(s)
    assert chosen(decisions) == (Action.SLOW, Reason.HIDDEN_VEHICLE, -1, 0)
    # Fast comes to rest 3.93 m before the centre, 1.57 m behind the line.
    rest_m = 7.5 - 25.0 / 7.0
    expected = ((rest_m - 5.5) / 2.4) ** 2
    np.testing.assert_allclose(decisions.action_risks[0], [0.0, 0.0, expected])


def test_a_perceived_vehicle_that_forbids_the_action_is_named(situation: Make) -> None:
    vehicles = [
        {"id": 7, "lane": 3, "m": 90.0, "mps": 7.0},
        {"id": 8, "lane": 3, "m": 35.0, "mps": 7.0},
    ]
    decisions = decide(situation([LANE], vehicles))
    # Vehicle 8 is 21 m away in 2 s: 18 / 7 - 1.3667 = 1.2048 s for Fast. For Slow 0.1468 s is
    # less than its stop condition gives: at rest 3.6905 m before the centre, -0.5684.
    assert chosen(decisions) == (Action.STOP, Reason.VEHICLE, 1, 0)
    leave_s = 4.0 / 3.0 + 1.0 / 30.0
    fast = ((18.0 / 7.0 - leave_s - 3.0) / 2.9) ** 2
    slow = ((23.0 / 6.0 - 1.0 / 7.0 - 5.5) / 2.4) ** 2
    np.testing.assert_allclose(decisions.action_risks[0], [0.0, slow, fast])


def test_without_its_break_the_printed_loop_would_crawl(situation: Make) -> None:
    s = situation([LANE])
    ahead = foresee(s, RuleBasedConfig()).total[0]
    best = Action.STOP
    for action in (Action.FAST, Action.SLOW):  # Algorithm 1 as printed
        if ahead[action] >= 0.0:
            best = action
    assert best == Action.SLOW
    assert decide(s).action[0] == Action.FAST


def as_printed(s: Situations) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Algorithm 1 to the letter: every safe action overwrites the one before, fast comes first."""
    safe = foresee(s, RuleBasedConfig()).total >= 0.0
    best = np.zeros(len(safe), dtype=np.int64)
    for action in (Action.FAST, Action.SLOW):
        best[safe[:, action]] = action
    return best


def test_as_printed_it_crawls_over_an_intersection_that_nobody_else_is_near(
    situation: Make,
) -> None:
    # "Always takes the fastest safe velocity": fast is safe, and the printed loop takes slow.
    s = situation()
    assert as_printed(s)[0] == Action.SLOW
    assert decide(s).action[0] == Action.FAST


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_missing_break_matters_just_where_fast_and_slow_are_safe(
    random_situations: Make, seed: int
) -> None:
    s = random_situations(seed, 64)
    printed, ours = as_printed(s), decide(s).action
    safe = foresee(s, RuleBasedConfig()).total >= 0.0
    differ = printed != ours
    # Where both are safe slow overwrites fast; nowhere else does the break matter.
    np.testing.assert_array_equal(differ, safe[:, Action.FAST] & safe[:, Action.SLOW])
    assert (printed[differ] == Action.SLOW).all()
    assert (ours[differ] == Action.FAST).all()


def test_it_waits_for_a_vehicle_that_may_linger_in_the_zone(situation: Make) -> None:
    # 5 m before the centre, 8 m to leave in 2 s: at 3.9 m/s it may still be there.
    for mps, action in ((3.9, Action.STOP), (4.1, Action.FAST)):
        vehicle = {"id": 1, "lane": 3, "m": 5.0, "mps": mps}
        assert decide(situation([LANE], [vehicle])).action[0] == action


@pytest.mark.parametrize(
    ("mps", "margin_m", "action"),
    [(5.0, 1.8, Action.FAST), (0.0, 1.0, Action.FAST), (0.0, 1.8, Action.SLOW)],
)
def test_it_follows_a_leader_onto_a_merging_lane(
    situation: Make, mps: float, margin_m: float, action: Action
) -> None:
    # The ego at rest is 8.5 m before the join, the leader 1.5 m past it. Fast ends 5.5 m before
    # it at 3 m/s, 9 / 7 = 1.29 m from rest: a leader that stands is then 5.71 m ahead of it.
    lane = {"id": 5, "ego_m": -1.5, "ego_zone_m": 20.0, "zone_m": 20.0, "merging": True}
    vehicle = {"id": 1, "lane": 5, "m": -11.5, "mps": mps}
    s = situation([lane | {"hidden_m": 200.0}], [vehicle], stop_line_m=-20.0)
    config = RuleBasedConfig(risk=RiskConfig(leader_margin_m=margin_m))
    decisions = RuleBasedPolicy(config).decide(s, np.ones(1, dtype=bool))
    assert decisions.action[0] == action
    assert decisions.critical_vehicle[0] == (-1 if action == Action.FAST else 0)


def test_the_hash_is_that_of_the_configuration() -> None:
    policy = RuleBasedPolicy()
    assert policy.name == "rule_based"
    assert policy.hash == RuleBasedPolicy(RuleBasedConfig()).hash
    assert len(policy.hash) == 64
    other = RuleBasedConfig(risk=RiskConfig(desired_gap_s=2.0))
    assert RuleBasedPolicy(other).hash != policy.hash


def test_a_prediction_needs_time() -> None:
    assert RuleBasedConfig().horizon_s == 2.0
    for name in ("prediction_steps", "decision_period_s"):
        changes: dict[str, Any] = {name: 0}
        with pytest.raises(ConfigurationError, match=rf"RuleBasedConfig\.{name} is 0"):
            replace(RuleBasedConfig(), **changes)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_row_of_a_batch_is_a_batch_of_one(random_situations: Make, seed: int) -> None:
    s = random_situations(seed, 4)
    whole = decide(s)
    for i in range(4):
        one = decide(Situations._make(field[i : i + 1] for field in s))
        for name, many, single in zip(whole._fields, whole, one, strict=True):
            if many is None:  # only a supervisor fills it
                assert single is None
            else:
                np.testing.assert_array_equal(many[i], single[0], err_msg=name)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_reasons_agree_with_what_is_critical(random_situations: Make, seed: int) -> None:
    decisions = decide(random_situations(seed, 16))
    fast = decisions.action == Action.FAST
    np.testing.assert_array_equal(decisions.reason == Reason.CLEAR, fast)
    np.testing.assert_array_equal(decisions.critical_lane == -1, fast)
    vehicle = decisions.critical_vehicle >= 0
    np.testing.assert_array_equal(decisions.reason == Reason.VEHICLE, vehicle)
