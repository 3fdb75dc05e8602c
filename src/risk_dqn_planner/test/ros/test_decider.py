# SPDX-License-Identifier: Apache-2.0
"""When the policy is asked, what it is told, and what is decided without it."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.decision import Action, Decision, Reason
from risk_dqn_planner.policies.base import Decisions, Policy
from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.supervised import Supervisor
from risk_dqn_planner.ros.decider import (
    Choice,
    Decider,
    DeciderConfig,
    Trouble,
    UnusablePolicy,
)
from risk_dqn_planner.situation.report import FaultyInput, SituationReport, Status
from risk_dqn_planner.situation.situations import Booleans, Situations
from risk_dqn_planner.situation.warm_up import example_situation

MS = 1_000_000
SITUATION = example_situation()
AT_ONCE = DeciderConfig(recovery_s=0.0)


@dataclass
class Recorder:
    """A policy that always drives fast and keeps the restart flags it was given."""

    name: str = "recorder"
    hash: str = "abc"
    restarts: list[bool] = field(default_factory=list)
    failure: Exception | None = None

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        if self.failure is not None:
            raise self.failure
        assert situations.lane_mask.all()
        self.restarts += restart.tolist()
        unknown, none = np.full((1, 3), math.nan), np.array([-1])
        fast, clear = np.array([int(Action.FAST)]), np.array([int(Reason.CLEAR)])
        return Decisions(fast, unknown, unknown, clear, none, none)


def explain(decisions: Decisions, given: Situations, index: int, policy: Policy) -> Decision:
    action = Action(decisions.action[index])
    unknown = np.full(3, math.nan)
    assert given.lane_mask.all()
    return Decision(
        action, 5.0, Reason.CLEAR, "FAST", unknown, unknown, None, None, policy.name, policy.hash
    )


def decider(policy: Policy | UnusablePolicy, config: DeciderConfig = AT_ONCE) -> Decider:
    return Decider(policy, explain, config)


def report(stamp_ms: int, route: tuple[int, ...] = (1, 2), errand_ms: int = 0) -> SituationReport:
    return SituationReport(
        stamp_ms * MS, Status.OK, "", route, situations=SITUATION, route_stamp_ns=errand_ms * MS
    )


def fault(
    stamp_ms: int,
    status: Status = Status.NOT_FINITE,
    source: FaultyInput = FaultyInput.ODOMETRY,
    errand_ms: int = 0,
) -> SituationReport:
    return SituationReport(
        stamp_ms * MS, status, "odd", (1, 2), source=source, route_stamp_ns=errand_ms * MS
    )


def decide_at(node: Decider, now_ms: int, given: SituationReport | None = None) -> Choice:
    if given is not None:
        node.receive(given, now_ms * MS, now_ms * MS)
    return node.decide(now_ms * MS, now_ms * MS)


def reason(choice: Choice) -> Reason:
    stopped = choice.decision.action is Action.STOP
    assert stopped == choice.decision.reason.is_fault
    return choice.decision.reason


def test_before_any_situation_the_decision_is_stop() -> None:
    choice = decide_at(decider(Recorder()), 0)
    assert reason(choice) is Reason.MISSING_INPUT
    assert choice.decision.faulty_input is FaultyInput.SITUATION
    assert choice.decision.text == "STOP: no situation received yet"
    assert choice.decision.target_speed_mps == 0.0
    assert choice.decision.policy_name == "recorder"
    assert choice.situation_stamp_ns is None


def test_the_policy_decides_on_a_fresh_situation() -> None:
    choice = decide_at(decider(Recorder()), 1100, report(1000))
    assert choice.decision.action is Action.FAST
    assert choice.situation_stamp_ns == 1000 * MS


def test_a_situation_of_exactly_the_allowed_age_is_used_and_an_older_one_is_not() -> None:
    node = decider(Recorder())
    assert decide_at(node, 1500, report(1000)).decision.action is Action.FAST
    choice = decide_at(node, 1501)
    assert reason(choice) is Reason.STALE_INPUT
    assert choice.decision.text == "STOP: situation is 0.50 s old, expected at most 0.5 s"
    assert choice.situation_stamp_ns == 1000 * MS


def test_a_situation_far_ahead_of_the_clock_is_not_used() -> None:
    choice = decide_at(decider(Recorder()), 1000, report(9000))
    assert reason(choice) is Reason.FUTURE_INPUT
    assert "8.00 s ahead of the clock" in choice.decision.text


@pytest.mark.parametrize("status", [status for status in Status if status is not Status.OK])
def test_a_fault_is_passed_on_in_its_own_words(status: Status) -> None:
    text = "the ego is 9.0 m beside its route"
    odd = SituationReport(1000 * MS, status, text, source=FaultyInput.ODOMETRY)
    choice = decide_at(decider(Recorder()), 1000, odd)
    assert (reason(choice).name, int(reason(choice))) == (status.name, int(status))
    assert choice.decision.faulty_input is FaultyInput.ODOMETRY
    assert choice.decision.text == "STOP: the ego is 9.0 m beside its route"


def test_a_fault_that_nobody_repeats_grows_old_itself() -> None:
    node = decider(Recorder())
    assert reason(decide_at(node, 1000, fault(1000))) is Reason.NOT_FINITE
    choice = decide_at(node, 1501)
    assert (reason(choice), choice.decision.faulty_input) == (
        Reason.STALE_INPUT,
        FaultyInput.SITUATION,
    )
    assert choice.decision.text == "STOP: nothing heard of the situation for 0.50 s; last: odd"


def test_a_fault_between_two_decisions_is_told_of_by_the_second_one() -> None:
    node = decider(Recorder())
    decide_at(node, 500, report(500))
    node.receive(fault(600), 600 * MS)
    choice = decide_at(node, 1000, report(1000))
    assert reason(choice) is Reason.NOT_FINITE
    assert decide_at(node, 1500, report(1500)).decision.action is Action.FAST


def actions(node: Decider, *reports: SituationReport) -> list[Reason]:
    return [reason(decide_at(node, each.stamp_ns // MS, each)) for each in reports]


def test_after_a_fault_all_must_be_good_for_the_stated_time() -> None:
    node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
    assert actions(node, report(0), fault(500), report(1000), report(1999), report(2000)) == [
        Reason.CLEAR, Reason.NOT_FINITE, Reason.RECOVERING, Reason.RECOVERING, Reason.CLEAR,
    ]  # fmt: skip


def test_how_often_a_fault_is_complained_of_does_not_bear_on_the_recovery() -> None:
    for complaints in ([], [fault(600)], [fault(600), fault(900)]):
        node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
        actions(node, report(0), fault(500), *complaints)
        found = actions(node, report(1000), report(1500), report(2000))
        assert found == [Reason.RECOVERING, Reason.RECOVERING, Reason.CLEAR]


def test_while_recovering_the_decision_says_from_what_and_for_how_long() -> None:
    node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
    actions(node, report(0), fault(500))
    actions(node, report(600))
    choice = decide_at(node, 1000, report(1000))
    assert choice.decision.text == "STOP: good for 0.4 of 1 s after: odd"
    assert choice.decision.faulty_input is FaultyInput.ODOMETRY


def test_every_fault_begins_the_recovery_anew() -> None:
    node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
    assert actions(node, report(0), fault(500), report(1000), fault(1400), report(2000)) == [
        Reason.CLEAR, Reason.NOT_FINITE, Reason.RECOVERING, Reason.NOT_FINITE, Reason.RECOVERING,
    ]  # fmt: skip
    assert actions(node, report(2999), report(3000)) == [Reason.RECOVERING, Reason.CLEAR]


def test_the_start_needs_no_recovery_from_inputs_that_were_missing() -> None:
    node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
    missing = fault(0, Status.MISSING_INPUT, FaultyInput.OBJECTS)
    assert actions(node, missing, report(500)) == [Reason.MISSING_INPUT, Reason.CLEAR]


def test_broken_numbers_need_recovery_even_at_the_start() -> None:
    node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
    assert actions(node, fault(0), report(500)) == [Reason.NOT_FINITE, Reason.RECOVERING]


def test_inputs_that_were_lost_need_recovery() -> None:
    node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
    actions(node, report(0))
    assert reason(decide_at(node, 2000)) is Reason.STALE_INPUT
    assert actions(node, report(2500), report(3000), report(3500)) == [
        Reason.RECOVERING, Reason.RECOVERING, Reason.CLEAR,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("status", "expected"),
    [
        (Status.STALE_INPUT, Reason.CLEAR),
        (Status.OFF_ROUTE, Reason.CLEAR),
        (Status.IMPLAUSIBLE_JUMP, Reason.RECOVERING),
    ],
)
def test_a_new_errand_settles_what_was_wrong_with_the_old_one_but_no_broken_input(
    status: Status, expected: Reason
) -> None:
    node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
    actions(node, report(0), fault(500, status))
    # Repeated with the new errand's name before its first inputs arrive.
    node.receive(fault(700, status, errand_ms=700), 700 * MS)
    assert actions(node, report(800, errand_ms=700)) in ([expected], [Reason(status)])
    assert actions(node, report(1000, errand_ms=700)) == [expected]


def test_a_new_errand_starts_the_history_anew() -> None:
    policy = Recorder()
    node = decider(policy)
    actions(node, report(0), report(500), report(1000, errand_ms=900), report(1500, errand_ms=900))
    assert policy.restarts == [True, False, True, False]


def test_it_recovers_when_situations_come_back() -> None:
    node = decider(Recorder())
    decide_at(node, 500, report(500))
    assert reason(decide_at(node, 9000)) is Reason.STALE_INPUT
    assert decide_at(node, 9500, report(9500)).decision.action is Action.FAST


def restarts(*stamps_ms: int) -> list[bool]:
    policy = Recorder()
    node = decider(policy)
    for stamp_ms in stamps_ms:
        decide_at(node, stamp_ms, report(stamp_ms))
    return policy.restarts


def test_history_starts_with_the_first_situation_and_after_a_gap_only() -> None:
    assert restarts(0, 500, 1000) == [True, False, False]
    assert restarts(0, 750, 1501) == [True, False, True]


def test_history_starts_anew_on_another_route() -> None:
    policy = Recorder()
    node = decider(policy)
    for stamp_ms, route in ((0, (1,)), (500, (1,)), (1000, (2,)), (1500, (2,))):
        decide_at(node, stamp_ms, report(stamp_ms, route))
    assert policy.restarts == [True, False, True, False]


def test_history_goes_on_over_a_fault_shorter_than_the_gap() -> None:
    policy = Recorder()
    node = decider(policy)
    decide_at(node, 0, report(0))
    decide_at(node, 500, fault(500))
    decide_at(node, 700, report(700))
    assert policy.restarts == [True, False]


def test_a_situation_that_was_just_decided_on_is_not_put_into_the_history_twice() -> None:
    policy = Recorder()
    node = decider(policy)
    first = decide_at(node, 1000, report(1000))
    assert decide_at(node, 1250, report(1000)) == first
    assert policy.restarts == [True]


def test_a_situation_that_was_decided_on_before_is_frozen() -> None:
    node = decider(Recorder())
    decide_at(node, 1000, report(1000))
    choice = decide_at(node, 1251)
    assert (reason(choice), choice.decision.faulty_input) == (
        Reason.FROZEN_INPUT,
        FaultyInput.SITUATION,
    )
    assert choice.decision.text == "STOP: no new situation since the one decided on 0.25 s ago"


def test_situations_that_keep_coming_with_an_old_stamp_are_frozen() -> None:
    node = decider(Recorder())
    decide_at(node, 1000, report(1000))
    for now_ms in (1200, 1400, 1600):
        node.receive(report(1000), now_ms * MS, now_ms * MS)
    choice = decide_at(node, 1600)
    assert reason(choice) is Reason.FROZEN_INPUT
    assert "keeps coming with the same stamp, 0.60 s old" in choice.decision.text


def test_a_situation_that_goes_back_in_time_is_a_fault_once_and_then_the_new_time_counts() -> None:
    policy = Recorder()
    node = decider(policy)
    decide_at(node, 1000, report(1000))
    choice = decide_at(node, 1000, report(900))
    assert reason(choice) is Reason.OUT_OF_ORDER_INPUT
    assert "went back in time by 0.100 s" in choice.decision.text
    assert decide_at(node, 1000, report(950)).decision.action is Action.FAST
    assert policy.restarts == [True, True]


def test_a_fault_newer_than_the_situation_after_it_does_not_count_as_out_of_order() -> None:
    # Faults bear the clock's time, which runs ahead of the objects' stamps.
    node = decider(Recorder())
    decide_at(node, 1000, report(980))
    decide_at(node, 1500, fault(1490, Status.STALE_INPUT))
    assert decide_at(node, 1600, report(1480)).decision.action is Action.FAST


def test_after_the_clock_has_jumped_back_all_starts_anew_without_a_fault() -> None:
    policy = Recorder()
    node = decider(policy, DeciderConfig(recovery_s=1.0))
    decide_at(node, 60_000, report(60_000))
    node.clock_went_back(500 * MS)
    assert reason(decide_at(node, 500)) is Reason.MISSING_INPUT
    assert decide_at(node, 1000, report(1000)).decision.action is Action.FAST
    assert policy.restarts == [True, True]


def test_a_clock_that_jumps_back_does_not_shorten_the_recovery() -> None:
    node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
    actions(node, report(60_000), fault(60_400))
    node.clock_went_back(500 * MS)
    assert actions(node, report(1000), report(1999), report(2000)) == [
        Reason.RECOVERING, Reason.RECOVERING, Reason.CLEAR,
    ]  # fmt: skip


def test_trouble_from_elsewhere_is_told_of_once_and_recovered_from() -> None:
    node = decider(Recorder(), DeciderConfig(recovery_s=1.0))
    actions(node, report(0))
    node.doubt(Trouble(Reason.FROZEN_INPUT, FaultyInput.CLOCK, "the clock stands"))
    choice = decide_at(node, 500, report(500))
    assert (reason(choice), choice.decision.text) == (
        Reason.FROZEN_INPUT,
        "STOP: the clock stands",
    )
    assert actions(node, report(1000), report(1500)) == [Reason.RECOVERING, Reason.CLEAR]


def test_a_clock_that_stands_comes_before_what_the_situation_lacks() -> None:
    trouble = Trouble(Reason.FROZEN_INPUT, FaultyInput.CLOCK, "the clock stands")
    choice = decider(Recorder()).decide(0, 0, trouble)
    assert (reason(choice), choice.decision.faulty_input) == (
        Reason.FROZEN_INPUT,
        FaultyInput.CLOCK,
    )


def test_limits_may_change_while_it_decides() -> None:
    node = decider(Recorder())
    decide_at(node, 0, report(0))
    node.reconfigure(DeciderConfig(max_situation_age_s=0.1))
    assert reason(decide_at(node, 500, report(350))) is Reason.STALE_INPUT


def test_a_failing_policy_stops_the_vehicle_and_says_why() -> None:
    policy = Recorder(failure=RuntimeError("size mismatch\n  in layer 2"))
    node = decider(policy)
    choice = decide_at(node, 1000, report(1000))
    assert reason(choice) is Reason.POLICY_FAILED
    assert choice.decision.text == (
        "STOP: policy recorder failed: RuntimeError: size mismatch in layer 2"
    )
    policy.failure = None
    assert decide_at(node, 1500, report(1500)).decision.action is Action.FAST
    assert policy.restarts == [True]


def test_after_a_policy_has_failed_it_is_not_asked_until_all_was_good_for_a_while() -> None:
    policy = Recorder(failure=RuntimeError("no"))
    node = decider(policy, DeciderConfig(recovery_s=1.0))
    decide_at(node, 0, report(0))
    policy.failure = None
    assert actions(node, report(500), report(1000), report(1500)) == [
        Reason.RECOVERING, Reason.RECOVERING, Reason.CLEAR,
    ]  # fmt: skip


def test_a_policy_that_could_not_be_loaded_stops_the_vehicle_whatever_arrives() -> None:
    node = decider(UnusablePolicy("net.pt", "net.pt does not exist"))
    for given_one in (None, report(1000)):
        choice = decide_at(node, 1000, given_one)
        assert reason(choice) is Reason.POLICY_REFUSED
        assert choice.decision.faulty_input is FaultyInput.POLICY
        assert choice.decision.text == "STOP: net.pt does not exist"
        assert choice.decision.policy_name == "net.pt"


def test_a_policy_that_is_not_loaded_yet_stops_the_vehicle_and_says_so() -> None:
    text = "policy net.pt is still being loaded"
    node = decider(UnusablePolicy("net.pt", text, reason=Reason.POLICY_NOT_READY))
    choice = decide_at(node, 1000, report(1000))
    assert choice.decision.action is Action.STOP
    assert reason(choice) is Reason.POLICY_NOT_READY
    assert choice.decision.text == f"STOP: {text}"


@pytest.mark.parametrize("supervised", [True, False])
def test_after_a_stop_of_another_s_a_supervisor_s_memory_is_void(supervised: bool) -> None:
    policy = Recorder()
    node = Decider(policy, explain, AT_ONCE, restart_after_fault=supervised)
    decide_at(node, 0, report(0))
    decide_at(node, 500, fault(500))
    decide_at(node, 700, report(700))
    decide_at(node, 1200, report(1200))
    assert policy.restarts == [True, supervised, False]


class BrokenCheck(Supervisor):
    """A supervisor whose check fails."""

    def __init__(self) -> None:
        super().__init__(ConstantPolicy(Action.FAST))

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        super().decide(situations, restart)
        raise ZeroDivisionError("no gap")


def test_a_supervisor_that_fails_is_answered_with_stop() -> None:
    choice = decide_at(decider(BrokenCheck()), 1000, report(1000))
    assert reason(choice) is Reason.POLICY_FAILED
    assert choice.decision.text == (
        "STOP: policy always_fast+supervisor failed: ZeroDivisionError: no gap"
    )


EVENTS = st.lists(
    st.tuples(
        st.integers(0, 700),  # until then [ms]
        st.sampled_from([None, *Status]),
        st.integers(-700, 300),  # of the report's stamp against the clock [ms]
        st.integers(0, 1),  # errand
        st.booleans(),  # whether a decision is due
    ),
    max_size=40,
)


@given(EVENTS)
def test_whatever_comes_the_ego_drives_on_fresh_new_undoubted_situations_only(
    events: list[tuple[int, Status | None, int, int, bool]],
) -> None:
    node, now_ms, newest, broken_ms = decider(Recorder(), DeciderConfig()), 2000, None, -10_000
    for wait_ms, status, offset_ms, errand, due in events:
        now_ms += wait_ms
        if status is not None:
            one = (
                report(now_ms + offset_ms, errand_ms=errand)
                if status is Status.OK
                else fault(now_ms + offset_ms, status, errand_ms=errand)
            )
            node.receive(one, now_ms * MS, now_ms * MS)
            newest = one
            if status is Status.NOT_FINITE:
                broken_ms = now_ms
        if due:
            decision = decide_at(node, now_ms).decision
            if not decision.reason.is_fault:
                assert newest is not None
                assert newest.situations is not None
                assert -200 <= now_ms - newest.stamp_ns // MS <= 500
                assert now_ms - broken_ms >= 1000
