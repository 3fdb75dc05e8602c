# SPDX-License-Identifier: Apache-2.0
"""The look-ahead policy: the first action of the best plan, and always a sound one."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.decision import explain
from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Action, Reason
from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.policies.look_ahead import LookAheadConfig, LookAheadPolicy
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
NEW = np.array([True])
# Two lanes of the paper's crossing, 10 m ahead of an ego at rest; the zones end at 20 m.
AHEAD: list[dict[str, Any]] = [{"id": 3, "ego_m": 13.1}, {"id": 4, "ego_m": 17.0}]


def first_action(s: Situations) -> Action:
    return Action(int(LookAheadPolicy().decide(s, NEW).action[0]))


def test_it_goes_at_once_on_an_empty_road(situation: Make) -> None:
    s = situation(AHEAD, goal_m=30.0)
    policy = LookAheadPolicy()
    decisions = policy.decide(s, NEW)
    assert decisions.action[0] == Action.FAST
    assert decisions.reason[0] == Reason.CLEAR
    assert explain(decisions, s, 0, policy).text.startswith("FAST: lane 4 is hidden beyond 70.0 m")


def test_it_goes_where_no_lane_conflicts(situation: Make) -> None:
    assert first_action(situation(goal_m=30.0)) == Action.FAST


def test_it_keeps_back_for_a_run_up_and_says_so(situation: Make) -> None:
    # At 4 m/s the vehicle is in its zone from 3.0 to 4.5 s. Run up to the line at 10 m, the ego
    # would stand there by 3.7 s, and start from rest; from where it is it comes there at speed.
    coming = {"id": 8, "lane": 3, "m": 15.0, "mps": 4.0}
    s = situation(AHEAD, [coming], goal_m=30.0)
    policy = LookAheadPolicy()
    decisions = policy.decide(s, NEW)
    assert FastestSoundPolicy().decide(s, NEW).action[0] == Action.FAST
    assert decisions.action[0] < Action.FAST
    decision = explain(decisions, s, 0, policy)
    assert decision.critical_vehicle_id == 8
    assert "keeps back" in decision.text


def test_it_drives_nearer_where_it_cannot_see_far_enough(situation: Make) -> None:
    # A vehicle that hides 12 m before its zone would be there in 1.3 s: no run-up helps.
    hidden = [lane | {"hidden_m": 12.0} for lane in AHEAD]
    assert first_action(situation(hidden, goal_m=30.0)) == Action.FAST


@pytest.mark.parametrize("left_m", [0.56, 0.84])
def test_it_creeps_on_where_a_hop_still_fits_before_the_line(
    situation: Make, left_m: float
) -> None:
    # The shortest hop takes 0.27 m; from nearer by the ego sees more of what is hidden.
    lanes = [
        {"id": 3, "ego_m": left_m + 3.1, "hidden_m": 24.0},
        {"id": 4, "ego_m": left_m + 6.6, "hidden_m": 24.0},
    ]
    assert first_action(situation(lanes, goal_m=30.0)) > Action.STOP


def test_it_joins_a_queue_rather_than_wait_for_it_to_move(situation: Make) -> None:
    # The queue in the lane stands; behind the join nobody comes for a while.
    lane = {"id": 3, "ego_m": 3.2, "merging": True, "hidden_m": 70.0}
    standing = {"id": 7, "lane": 3, "m": -12.0, "mps": 0.0}
    coming = {"id": 8, "lane": 3, "m": 50.0, "mps": 6.0}
    s = situation([lane], [standing, coming], goal_m=30.0)
    hesitant = LookAheadPolicy(config=LookAheadConfig(chance_price_s=0.0, haste=0.0))
    assert hesitant.decide(s, NEW).action[0] == Action.STOP
    assert first_action(s) > Action.STOP


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**31), delay_s=st.sampled_from([0.0, 0.2]))
def test_it_never_takes_an_action_that_is_not_sound(
    random_situations: Make, seed: int, delay_s: float
) -> None:
    assumptions = SafetyAssumptions(actuation_delay_s=delay_s)
    policy, guard = LookAheadPolicy(assumptions), Guard(assumptions)
    restart = np.ones(20, dtype=bool)
    for step in range(3):
        s = random_situations(seed + step, 20)
        action = policy.decide(s, restart).action
        check = guard.look(s, restart)
        assert np.take_along_axis(guard.sound(check), action[:, None], axis=1).all()
        guard.decided(check, action)
        restart = restart & False


def test_rows_of_a_batch_do_not_disturb_each_other(random_situations: Make) -> None:
    together, restart = LookAheadPolicy(), np.ones(30, dtype=bool)
    alone = [LookAheadPolicy() for _ in range(30)]
    for seed in range(3):
        batch = random_situations(seed, 30)
        decisions = together.decide(batch, restart)
        for row in range(30):
            one = Situations._make(field[row : row + 1] for field in batch)
            single = alone[row].decide(one, restart[:1])
            for field, fields in zip(single[:6], decisions[:6], strict=True):
                np.testing.assert_array_equal(field[0], fields[row])
        restart = restart & False


def test_the_same_situations_give_the_same_decisions(random_situations: Make) -> None:
    s, restart = random_situations(5, 100), np.ones(100, dtype=bool)
    policy = LookAheadPolicy()
    first, again = policy.decide(s, restart), policy.decide(s, restart)
    np.testing.assert_array_equal(first.action, again.action)
    np.testing.assert_array_equal(LookAheadPolicy().decide(s, restart).action, again.action)


def test_it_is_known_by_name_and_its_hash_by_its_configuration() -> None:
    policy = load_policy("look_ahead")
    assert policy.name == "look_ahead"
    assert policy.hash == LookAheadPolicy().hash
    assert policy.hash != LookAheadPolicy(config=LookAheadConfig(decisions=9)).hash
    assert policy.hash != FastestSoundPolicy().hash


@pytest.mark.parametrize("name", ["decisions", "fine_cells", "cell_m", "cell_mps"])
def test_a_configuration_that_makes_no_sense_is_refused(name: str) -> None:
    with pytest.raises(ConfigurationError, match=f"LookAheadConfig.{name} is 0"):
        LookAheadConfig(**{name: 0})
    with pytest.raises(ConfigurationError, match="gap_price is -1"):
        LookAheadConfig(gap_price=-1)
