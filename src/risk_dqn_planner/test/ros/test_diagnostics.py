# SPDX-License-Identifier: Apache-2.0
"""What /diagnostics says of an input."""

import pytest

from risk_dqn_planner.ros.diagnostics import ERROR, OK, STALE, WARN, stream_status
from risk_dqn_planner.ros.streams import AgeLimits, RateLimits, Stream
from risk_dqn_planner.situation.report import Fault, FaultyInput, Status

MS = 1_000_000
RATES = RateLimits(min_rate_hz=5.0, max_rate_hz=20.0)


def stream(*stamps_ms: int) -> Stream:
    one = Stream(FaultyInput.OBJECTS, AgeLimits(0.5, 0.2))
    for stamp_ms in stamps_ms:
        one.receive(stamp_ms * MS, "message", stamp_ms * MS, stamp_ms * MS)
    return one


def test_an_input_that_never_came_is_stale() -> None:
    level, text, values = stream_status(stream(), 0, RATES)
    assert (level, text, values["received"]) == (STALE, "never received", 0)


def test_an_old_input_is_stale_and_says_how_old_it_is() -> None:
    level, text, values = stream_status(stream(0), 600 * MS, RATES)
    assert (level, text) == (STALE, "0.60 s old, expected at most 0.5 s")
    assert values["age_s"] == pytest.approx(0.6)


@pytest.mark.parametrize(
    ("period_ms", "level", "text"),
    [
        (100, OK, "received at 10.0 Hz"),
        (250, WARN, "at 4.0 Hz, expected 5 to 20"),
        (40, WARN, "at 25.0 Hz, expected 5 to 20"),
    ],
)
def test_a_rate_out_of_its_range_is_a_warning_with_figures(
    period_ms: int, level: bytes, text: str
) -> None:
    one = stream(*range(0, 3000, period_ms))
    assert stream_status(one, 3000 * MS, RATES)[:2] == (level, text)


def test_a_fault_is_an_error_while_it_is_recent_and_counted_for_ever() -> None:
    one = stream(*range(0, 1000, 100))
    one.note(Fault(900 * MS, Status.NOT_FINITE, FaultyInput.OBJECTS, "x_m is nan"))
    level, text, _ = stream_status(one, 1000 * MS, RATES)
    assert (level, text) == (ERROR, "NOT_FINITE: x_m is nan")
    for stamp_ms in range(1000, 2000, 100):
        one.receive(stamp_ms * MS, "message", stamp_ms * MS, stamp_ms * MS)
    level, _, values = stream_status(one, 1950 * MS, RATES)
    assert (level, values["faults"]) == (OK, {"NOT_FINITE": 1})


def test_a_fault_that_is_stamped_ahead_of_the_clock_is_an_error_now() -> None:
    one = stream(*range(0, 1000, 100))
    one.note(Fault(1200 * MS, Status.FUTURE_INPUT, FaultyInput.OBJECTS, "ahead"))
    assert stream_status(one, 1000 * MS, RATES)[0] == ERROR
    # A clock that has gone back by more leaves it behind.
    one.receive(0, "message", 0, 0)
    assert stream_status(one, 0, RATES)[0] == OK
