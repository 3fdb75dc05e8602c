# SPDX-License-Identifier: Apache-2.0
"""The policy node says Stop whatever fails within it, and ends undisturbed."""

import os
import signal
import time
from collections.abc import Iterator

import pytest
import rclpy
from intersection_msgs.msg import Decision, Situation
from rclpy.serialization import serialize_message

from risk_dqn_planner.decision import Reason, fault_decision
from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.ros.decider import Choice
from risk_dqn_planner.ros.main import run_managed
from risk_dqn_planner.ros.policy_node import PolicyNode
from risk_dqn_planner.ros.qos import NEWEST
from risk_dqn_planner.ros.situation_records import SituationRecords
from risk_dqn_planner.situation.report import Status

NO_TEXT = "\udc80"  # what Python makes of a byte that is no UTF-8; no message can hold it


@pytest.fixture
def node() -> Iterator[PolicyNode]:
    rclpy.init(args=["--ros-args", "-p", "autostart:=false"])
    node = PolicyNode()
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def test_a_decision_that_fits_into_no_message_becomes_a_stop_that_does(
    node: PolicyNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[Decision] = []
    node.create_subscription(Decision, "~/output/decision", heard.append, NEWEST)
    unspeakable = fault_decision(Reason.MISSING_INPUT, NO_TEXT)
    monkeypatch.setattr(node._decider, "decide", lambda *_: Choice(unspeakable, None))
    deadline = time.monotonic() + 20.0
    while not heard and time.monotonic() < deadline:
        node.decide(1_000_000_000)
        rclpy.spin_once(node, timeout_sec=0.1)
    assert (heard[0].action, heard[0].reason) == (Decision.STOP, Decision.INTERNAL_ERROR)
    assert "UnicodeEncodeError" in heard[0].text


def test_a_situation_that_cannot_be_read_for_a_reason_of_our_own_is_a_fault(
    node: PolicyNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: SituationRecords) -> None:
        raise ZeroDivisionError("of our own")

    monkeypatch.setattr(conversions, "situation_from_records", fail)
    node._on_situation(bytes(serialize_message(Situation(route=[1, 2]))))
    report = node._decider._report
    assert report is not None
    assert (report.status, report.situations) == (Status.INTERNAL_ERROR, None)
    assert report.route == (1, 2)
    assert "of our own" in report.text


def test_a_situation_that_ends_too_early_counts_as_not_received(
    node: PolicyNode, capfd: pytest.CaptureFixture[str]
) -> None:
    whole = bytes(serialize_message(Situation(route=[1, 2])))
    node._on_situation(whole[:-1])
    assert node._decider._report is None
    assert "a situation cannot be read: a message ends too early" in capfd.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_node_that_ends_already_is_not_disturbed_by_being_asked_to(
    number: signal.Signals,
) -> None:
    class Ending(PolicyNode):
        def serve(self, *_: object) -> None:
            """As after the transition `shutdown`."""

        def destroy_node(self) -> None:
            os.kill(os.getpid(), number)
            time.sleep(0.01)
            super().destroy_node()

    before = {each: signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        assert run_managed("policy", Ending) == 0
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def test_decisions_more_frequent_than_situations_are_refused() -> None:
    rclpy.init(args=["--ros-args", "-p", "autostart:=false", "-p", "rate_hz:=5.0"])
    node = PolicyNode()
    try:
        with pytest.raises(ConfigurationError, match=r"rate_hz is 5, .*min_rate_hz \(4\)"):
            node.configure()
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


@pytest.mark.parametrize(("rate_hz", "expected_s"), [(2.0, 0.25), (4.0, 0.125)])
def test_what_was_decided_on_one_situation_serves_for_half_a_period_at_most(
    rate_hz: float, expected_s: float
) -> None:
    rclpy.init(args=["--ros-args", "-p", "autostart:=false", "-p", f"rate_hz:={rate_hz}"])
    node = PolicyNode()
    try:
        node.configure()
        assert node._decider.config.max_repeat_s == expected_s
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
