# SPDX-License-Identifier: Apache-2.0
"""Whoever sets the supervisor's times too tight is told so in /diagnostics."""

import pytest

from risk_dqn_planner.ros.assumed_times import AssumedTimes, Gaps
from risk_dqn_planner.safety.assumptions import SafetyAssumptions

MS = 1_000_000
TIMED = AssumedTimes.of(SafetyAssumptions(actuation_delay_s=0.2, period_error_s=0.05))


@pytest.mark.parametrize(("age_s", "told"), [(None, False), (0.2, False), (0.21, True)])
def test_a_situation_older_than_the_delay_grants_is_told(age_s: float | None, told: bool) -> None:
    text = TIMED.objection_to_age(age_s)
    assert bool(text) == told
    assert not told or "0.21 s old" in text


@pytest.mark.parametrize(
    ("gap_ms", "told"), [(500, False), (450, False), (550, False), (440, True), (560, True)]
)
def test_situations_too_near_or_too_far_apart_are_told_once(gap_ms: int, told: bool) -> None:
    gaps = Gaps()
    gaps.note(1000 * MS, TIMED)
    gaps.note((1000 + gap_ms) * MS, TIMED)
    gaps.note((1500 + gap_ms) * MS, TIMED)
    text = gaps.take()
    assert bool(text) == told
    assert not told or f"{gap_ms / 1000:.3f} s after" in text
    assert gaps.take() == ""


def test_nothing_is_told_where_nothing_is_assumed_or_a_fault_lies_between() -> None:
    gaps = Gaps()
    for assumed in (AssumedTimes.of(SafetyAssumptions()), None):
        gaps.note(1000 * MS, assumed)
        gaps.note(1700 * MS, assumed)
    gaps.note(None, TIMED)
    gaps.note(4000 * MS, TIMED)
    gaps.note(4000 * MS, TIMED)
    assert gaps.take() == ""
