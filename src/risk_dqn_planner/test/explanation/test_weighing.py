# SPDX-License-Identifier: Apache-2.0
"""What is told of real policies' decisions is true of the situation."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from risk_dqn_planner.decision import Decision, explain, text_of
from risk_dqn_planner.explanation.fields import Critical, Verdict
from risk_dqn_planner.policies.base import Action, Policy, Reason, Supervision
from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.policies.look_ahead import LookAheadPolicy
from risk_dqn_planner.policies.rule_based import RuleBasedPolicy
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY
from risk_dqn_planner.policies.supervised import Supervisor, SupervisorMode
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
BATCH = 150
DELAYED = SafetyAssumptions(actuation_delay_s=0.2, speed_error_mps=0.5, position_error_m=0.3)
POLICIES: dict[str, Callable[[], Policy]] = {
    "rule": RuleBasedPolicy,
    "sound": FastestSoundPolicy,
    "delayed": lambda: FastestSoundPolicy(DELAYED),
    "ahead": LookAheadPolicy,
    "learned": lambda: load_policy("tuned"),
    "sound_learned": lambda: load_policy(DEFAULT_POLICY),
    "supervised": lambda: Supervisor(load_policy("tuned")),
    "reported": lambda: Supervisor(ConstantPolicy(Action.FAST), SupervisorMode.REPORT),
}
CHECKED = ("sound", "delayed", "ahead", "sound_learned", "supervised", "reported")


@pytest.fixture(scope="module")
def told(random_situations: Make) -> dict[str, list[tuple[Decision, Situations]]]:
    """Decisions of every policy about the same random situations, each with its own one."""
    found: dict[str, list[tuple[Decision, Situations]]] = {}
    for name, make in POLICIES.items():
        policy = make()
        assumptions = DELAYED if name == "delayed" else None
        for seed in range(2):
            s = random_situations(seed, BATCH)
            decisions = policy.decide(s, np.full(BATCH, seed == 0))
            for row in range(BATCH):
                one = Situations._make(field[row] for field in s)
                decision = explain(decisions, s, row, policy, assumptions=assumptions)
                found.setdefault(name, []).append((decision, one))
    return found


def has_leader(s: Situations) -> bool:
    """Whether anybody has joined the ego's path: of such the check may name any."""
    lane = s.vehicle_lane
    joined = s.lane_merging[lane] & (s.vehicle_distance_m <= -0.5 * s.lane_zone_m[lane])
    return bool((s.vehicle_mask & joined).any())


SAME_LANE = (Critical.AHEAD, Critical.BEHIND)
Told = dict[str, list[tuple[Decision, Situations]]]


@pytest.mark.parametrize("name", POLICIES)
def test_words_follow_from_the_published_fields(told: Told, name: str) -> None:
    for decision, _ in told[name]:
        assert decision.text == text_of(decision)
        assert len(decision.text) <= 152, decision.text


@pytest.mark.parametrize("name", POLICIES)
def test_distance_and_speed_are_those_of_whom_it_names(told: Told, name: str) -> None:
    for decision, s in told[name]:
        why = decision.explanation
        assert why.ego_speed_mps == s.ego_speed_mps
        assert why.stop_line_distance_m == s.stop_line_distance_m
        assert (decision.critical_lane_id is None) == (why.critical is Critical.NOBODY)
        if decision.critical_lane_id is None:
            assert decision.critical_vehicle_id is None
            assert math.isnan(why.distance_m)
            continue
        (lane,) = np.flatnonzero(s.lane_mask & (s.lane_id == decision.critical_lane_id))
        assert why.merging == s.lane_merging[lane]
        assert why.ego_distance_m == s.lane_ego_distance_m[lane]
        assert why.hidden is (decision.critical_vehicle_id is None)
        assert (decision.reason is Reason.VEHICLE) <= (not why.hidden)
        assert (decision.reason is Reason.HIDDEN_VEHICLE) <= why.hidden
        if why.hidden:
            assert why.distance_m == s.lane_hidden_distance_m[lane]
            assert why.speed_mps == s.lane_speed_limit_mps[lane]
        else:
            at = s.vehicle_mask & (s.vehicle_id == decision.critical_vehicle_id)
            (vehicle,) = np.flatnonzero(at & (s.vehicle_lane == lane))
            assert why.distance_m == s.vehicle_distance_m[vehicle]
            assert why.speed_mps == s.vehicle_speed_mps[vehicle]


@pytest.mark.parametrize("name", POLICIES)
def test_what_lacks_is_the_gap_wanted_less_the_gap_there_is(told: Told, name: str) -> None:
    for decision, s in told[name]:
        why = decision.explanation
        if not math.isnan(why.gap_wanted_s):
            gap_s = why.reach_s - why.leave_s
            assert why.lacking_s == pytest.approx(why.gap_wanted_s - gap_s)
        if why.verdict in {Verdict.TOO_LATE, Verdict.NO_WAY_OUT}:
            assert why.lacking_s > 0.0 or why.critical in SAME_LANE or has_leader(s)
        if why.verdict is Verdict.TOO_LATE:
            assert decision.action_risks[why.considered] > 0.0


@pytest.mark.parametrize("name", CHECKED)
def test_what_lacks_is_what_the_check_of_soundness_says(told: Told, name: str) -> None:
    forbidden = 0
    for decision, s in told[name]:
        why = decision.explanation
        assert not np.isnan(why.margins_s).any()
        if why.verdict is Verdict.NO_WAY_OUT and not has_leader(s):
            assert why.considered is not None
            assert why.lacking_s == pytest.approx(-why.margins_s[why.considered])
            forbidden += 1
    assert forbidden > 0


@pytest.mark.parametrize("name", ["sound", "ahead"])
def test_a_sound_policy_takes_what_lacks_nothing_or_carries_on(told: Told, name: str) -> None:
    for decision, _ in told[name]:
        why = decision.explanation
        assert (why.margins_s[decision.action] >= 0.0) is not why.no_action_is_sound
        if why.verdict is Verdict.KEEPS_BACK:
            assert why.margins_s[decision.action + 1] >= 0.0


def test_no_vehicle_comes_closer_in_time_than_the_one_that_is_named(told: Told) -> None:
    clear = 0
    for decision, s in told["rule"]:
        why = decision.explanation
        if decision.reason is not Reason.CLEAR or decision.critical_vehicle_id is None:
            continue
        (lane,) = np.flatnonzero(s.lane_mask & (s.lane_id == decision.critical_lane_id))
        for other in np.flatnonzero(s.vehicle_mask & (s.vehicle_lane == lane)):
            to_zone_m = s.vehicle_distance_m[other] - 0.5 * s.lane_zone_m[lane]
            past = s.vehicle_distance_m[other] + 0.5 * s.lane_zone_m[lane] <= 0.0
            # At the higher of its speed and the limit from the start, it would come no later.
            top_mps = max(s.vehicle_speed_mps[other], s.lane_speed_limit_mps[lane])
            same = s.vehicle_id[other] == decision.critical_vehicle_id
            if same:
                assert why.reach_s >= max(to_zone_m, 0.0) / top_mps - 1e-9
            elif not past and to_zone_m <= 0.0:
                assert why.reach_s == 0.0
        clear += 1
    assert clear > 10


def test_of_leaders_the_one_is_named_that_leaves_the_least_room_to_stop(situation: Make) -> None:
    # On the common path behind both joins: one 9 m ahead, one 40 m. After 0.5 s at 5 m/s the ego
    # rests 2.5 + 25 / 7 = 6.07 m on; it needs 5 m between the centres. 9 + 1 / 16 - 5 - 6.07 m.
    passed = {"ego_m": -9.0, "ego_zone_m": 20.0, "zone_m": 20.0, "merging": True}
    s = situation(
        [passed | {"id": 12, "ego_m": -11.0}],
        [
            {"id": 4, "lane": 12, "m": -20.0, "mps": 1.0},
            {"id": 2, "lane": 12, "m": -51.0, "mps": 5.0},
        ],
        ego_mps=5.0,
    )
    policy = FastestSoundPolicy()
    decision = explain(policy.decide(s, np.array([True])), s, 0, policy)
    assert decision.critical_vehicle_id == 4
    why = decision.explanation
    assert (why.critical, why.considered) == (Critical.AHEAD, Action.FAST)
    assert why.ahead_m == pytest.approx(9.0)
    assert why.lacking_s == pytest.approx((6.0714 + 5.0 - 9.0625) / 5.0, abs=1e-3)


def test_a_leader_far_ahead_is_not_blamed_for_what_a_hidden_place_forbids(situation: Make) -> None:
    # 1 m before the merging zone at 5 m/s: too late to stop, and anybody may come 4 m up the lane.
    lane = {"id": 12, "ego_m": 11.0, "ego_zone_m": 20.0, "zone_m": 20.0, "merging": True}
    s = situation(
        [lane | {"hidden_m": 14.0}], [{"id": 4, "lane": 12, "m": -30.0, "mps": 5.0}], ego_mps=5.0
    )
    policy = FastestSoundPolicy()
    decision = explain(policy.decide(s, np.array([True])), s, 0, policy)
    assert decision.explanation.verdict is Verdict.NO_WAY_OUT
    assert decision.reason is Reason.HIDDEN_VEHICLE
    assert (decision.critical_vehicle_id, decision.critical_lane_id) == (None, 12)
    assert "lane 12 is hidden beyond 14.0 m, a vehicle there merges in 0.6 s" in decision.text


@pytest.mark.parametrize("name", POLICIES)
def test_who_drives_ahead_is_ahead_and_who_drives_behind_behind(told: Told, name: str) -> None:
    for decision, _ in told[name]:
        why = decision.explanation
        assert (why.ahead_m > 0.0) == (why.critical is Critical.AHEAD)
        assert (why.ahead_m <= 0.0) == (why.critical is Critical.BEHIND)
        assert math.isfinite(why.reach_s) == (
            why.critical in {Critical.APPROACHING, Critical.IN_ZONE}
        )


def test_an_objection_considers_what_was_proposed(told: Told) -> None:
    objections = [d for d, _ in told["reported"] if d.supervision is Supervision.OBJECTED]
    assert objections
    for decision in objections:
        assert decision.explanation.considered is Action.FAST
        assert decision.explanation.verdict is Verdict.NO_WAY_OUT


@pytest.mark.parametrize("name", POLICIES)
def test_who_goes_has_left_or_can_stop(told: Told, name: str) -> None:
    verdicts = {d.explanation.verdict for d, _ in told[name] if d.reason is Reason.CLEAR}
    assert verdicts <= {
        Verdict.NOT_ASKED,
        Verdict.LEAVES_IN_TIME,
        Verdict.STOPS_IN_TIME,
        Verdict.KEEPS_BACK,
    }
