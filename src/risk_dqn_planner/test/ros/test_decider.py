# SPDX-License-Identifier: Apache-2.0
"""When the policy is asked, what it is told, and what is decided without it."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

from risk_dqn_planner.decision import Action, Decision, Reason
from risk_dqn_planner.policies.base import Decisions, Policy
from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.supervised import Supervisor
from risk_dqn_planner.ros.decider import Choice, Decider, DeciderConfig, UnusablePolicy
from risk_dqn_planner.situation.report import FaultyInput, SituationReport, Status
from risk_dqn_planner.situation.situations import Booleans, Situations
from risk_dqn_planner.situation.warm_up import example_situation

MS = 1_000_000
SITUATION = example_situation()


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


def decider(policy: Policy | UnusablePolicy) -> Decider:
    return Decider(policy, explain, DeciderConfig(max_situation_age_s=0.5, max_history_gap_s=0.75))


def report(stamp_ms: int, route: tuple[int, ...] = (1, 2)) -> SituationReport:
    return SituationReport(stamp_ms * MS, Status.OK, "", route, situations=SITUATION)


def decide_at(node: Decider, now_ms: int, given: SituationReport | None = None) -> Choice:
    if given is not None:
        node.receive(given)
    return node.decide(now_ms * MS)


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
    assert choice.decision.text == "STOP: the situation is 0.50 s old, expected at most 0.5 s"
    assert choice.situation_stamp_ns == 1000 * MS


def test_a_situation_far_ahead_of_the_clock_is_not_used() -> None:
    choice = decide_at(decider(Recorder()), 1000, report(9000))
    assert reason(choice) is Reason.FUTURE_INPUT
    assert "8.00 s ahead of the clock" in choice.decision.text


@pytest.mark.parametrize("status", [status for status in Status if status is not Status.OK])
def test_a_fault_is_passed_on_in_its_own_words(status: Status) -> None:
    text = "the ego is 9.0 m beside its route"
    fault = SituationReport(1000 * MS, status, text, source=FaultyInput.ODOMETRY)
    choice = decide_at(decider(Recorder()), 1000, fault)
    assert (reason(choice).name, int(reason(choice))) == (status.name, int(status))
    assert choice.decision.faulty_input is FaultyInput.ODOMETRY
    assert choice.decision.text == "STOP: the ego is 9.0 m beside its route"


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
    decide_at(node, 500, SituationReport(500 * MS, Status.MALFORMED_INPUT, "odd"))
    decide_at(node, 700, report(700))
    assert policy.restarts == [True, False]


def test_the_same_situation_is_not_put_into_the_history_twice() -> None:
    policy = Recorder()
    node = decider(policy)
    first = decide_at(node, 1000, report(1000))
    assert decide_at(node, 1400, report(1000)) == first
    assert policy.restarts == [True]


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
    decide_at(node, 1500, SituationReport(1490 * MS, Status.STALE_INPUT, "late"))
    assert decide_at(node, 1600, report(1480)).decision.action is Action.FAST


def test_after_the_clock_has_jumped_back_the_history_starts_anew_without_a_fault() -> None:
    policy = Recorder()
    node = decider(policy)
    decide_at(node, 60_000, report(60_000))
    node.forget()
    assert decide_at(node, 500, report(500)).decision.action is Action.FAST
    assert policy.restarts == [True, True]


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


def test_a_policy_that_could_not_be_loaded_stops_the_vehicle_whatever_arrives() -> None:
    node = decider(UnusablePolicy("net.pt", "net.pt does not exist"))
    for given in (None, report(1000)):
        choice = decide_at(node, 1000, given)
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
    node = Decider(policy, explain, DeciderConfig(), restart_after_fault=supervised)
    decide_at(node, 0, report(0))
    decide_at(node, 500, SituationReport(500 * MS, Status.MALFORMED_INPUT, "odd"))
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
