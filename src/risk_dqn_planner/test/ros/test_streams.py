# SPDX-License-Identifier: Apache-2.0
"""What is said of one input from the stamps of its messages. Times in milliseconds."""

import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.ros.streams import AgeLimits, InputRates, RateLimits, Stream
from risk_dqn_planner.situation.report import Fault, FaultyInput, Status

MS = 1_000_000
OBJECTS = FaultyInput.OBJECTS


def stream() -> Stream:
    return Stream(OBJECTS, AgeLimits(max_input_age_s=0.5, max_input_ahead_s=0.2))


def give(one: Stream, stamp_ms: int, now_ms: int | None = None) -> Fault | None:
    at_ms = stamp_ms if now_ms is None else now_ms
    return one.receive(stamp_ms * MS, "message", at_ms * MS, at_ms * MS)


def overdue(one: Stream, now_ms: int) -> Fault | None:
    return one.overdue(now_ms * MS, now_ms * MS, now_ms * MS)


def kind(fault: Fault | None) -> Status | None:
    return None if fault is None else fault.status


def test_what_never_came_is_missing() -> None:
    assert overdue(stream(), 0) == Fault(
        0, Status.MISSING_INPUT, OBJECTS, "no objects received yet"
    )


def test_what_comes_no_more_grows_stale() -> None:
    one = stream()
    give(one, 1000)
    assert overdue(one, 1500) is None
    assert kind(overdue(one, 1501)) is Status.STALE_INPUT


def test_what_keeps_coming_with_the_same_stamp_is_frozen_rather_than_stale() -> None:
    one = stream()
    for now_ms in (1000, 1100, 1300, 1500):
        assert give(one, 1000, now_ms) is None
    fault = overdue(one, 1501)
    assert kind(fault) is Status.FROZEN_INPUT
    assert fault is not None
    assert fault.text == (
        "objects keeps coming with the same stamp, 0.50 s old, expected at most 0.5 s"
    )
    assert kind(overdue(one, 2001)) is Status.STALE_INPUT  # now it comes no more, either


def test_what_comes_late_with_rising_stamps_is_stale() -> None:
    one = stream()
    for stamp_ms in (1000, 1100, 1200):
        give(one, stamp_ms, stamp_ms + 700)
    assert kind(overdue(one, 1900)) is Status.STALE_INPUT


def test_a_stamp_that_falls_is_a_fault_once() -> None:
    one = stream()
    give(one, 1000)
    assert kind(give(one, 990, 1000)) is Status.OUT_OF_ORDER_INPUT
    assert give(one, 1000, 1000) is None


def test_a_stamp_may_be_ahead_by_the_stated_lead_and_no_more() -> None:
    one = stream()
    assert give(one, 1200, 1000) is None
    assert kind(give(one, 1201, 1000)) is Status.FUTURE_INPUT
    assert kind(overdue(one, 1000)) is Status.FUTURE_INPUT
    assert overdue(one, 1001) is None


def test_the_rate_is_that_of_the_stamps_of_the_last_two_seconds() -> None:
    one = stream()
    assert one.rate_hz() is None
    for stamp_ms in range(0, 5000, 500):
        give(one, stamp_ms)
    assert one.rate_hz() == pytest.approx(2.0)
    for stamp_ms in range(5000, 8000, 100):
        give(one, stamp_ms)
    assert one.rate_hz() == pytest.approx(10.0)


def test_the_rate_of_messages_with_one_stamp_is_zero() -> None:
    one = stream()
    for _ in range(6):
        give(one, 1000)
    assert one.rate_hz() == 0.0


def test_faults_are_counted_by_kind() -> None:
    one = stream()
    for _ in range(3):
        one.note(Fault(0, Status.NOT_FINITE, OBJECTS, "x_m is nan"))
    assert dict(one.faults) == {"NOT_FINITE": 3}
    assert one.last_fault is not None
    assert one.last_fault.text == "x_m is nan"


def test_a_least_rate_above_the_greatest_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"min_rate_hz is 20.0, expected .* less than"):
        RateLimits(min_rate_hz=20.0, max_rate_hz=10.0)


def test_every_input_of_the_situation_has_its_rates() -> None:
    rates = InputRates(objects=RateLimits(1.0, 2.0))
    assert rates.of(FaultyInput.OBJECTS) == RateLimits(1.0, 2.0)
    assert rates.of(FaultyInput.VISIBLE_AREA) == RateLimits()
