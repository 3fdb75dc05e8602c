# SPDX-License-Identifier: Apache-2.0
"""Words say what the fields say: everything in them is read back and compared."""

import math
import re
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.explanation.fields import Critical, Explanation, Verdict
from risk_dqn_planner.explanation.sentence import Facts, sentence
from risk_dqn_planner.policies.base import Action, Reason, Supervision

# What each number in a sentence is, by the words around it.
READ = {
    "vehicle_id": r"vehicle (-?\d+) ",
    "lane_id": r"lane (-?\d+)",
    "reach_s": r"(?:zone of lane -?\d+|arrives|merges) in ([\d.]+) s",
    "leave_s": r"leaving takes ([\d.]+) s",
    "distance_m": r"hidden beyond (-?[\d.]+) m",
    "ahead_m": r"drives ([\d.]+) m (?:ahead|behind)",
    "speed_mps": r"at (-?[\d.]+) m/s",
    "gap_wanted_s": r"gap wanted ([\d.]+) s",
    "lacking_s": r"(-?[\d.]+) s of room",
    "lead": r"rated (-?[\d.e+-]+) above",
}
NUMBER = r"(?<![\w.])-?\d[\d.]*(?:e[+-]?\d+)?"


def read(text: str) -> dict[str, float]:
    """Every number of a sentence by its meaning; fails if one is left over."""
    found = {name: re.findall(pattern, text) for name, pattern in READ.items()}
    assert all(len(values) <= 1 for values in found.values()), text
    assert sum(map(len, found.values())) == len(re.findall(NUMBER, text)), text
    return {name: float(values[0]) for name, values in found.items() if values}


def facts(**changed: object) -> Facts:
    """A vehicle that forbids to go faster, as Algorithm 1 sees it."""
    why = Explanation(
        considered=Action.SLOW,
        verdict=Verdict.TOO_LATE,
        critical=Critical.APPROACHING,
        distance_m=18.0,
        speed_mps=7.0,
        reach_s=2.1,
        leave_s=3.4,
        gap_wanted_s=3.0,
        lacking_s=4.3,
    )
    given_ = {name: changed.pop(name) for name in Facts._fields if name in changed}
    usual: dict[str, Any] = {
        "action": Action.STOP,
        "reason": Reason.VEHICLE,
        "why": why._replace(**changed),
        "vehicle_id": 17,
        "lane_id": 3,
        "q_values": [math.nan] * 3,
        "supervision": Supervision.OFF,
        "proposed": None,
    }
    return Facts(**(usual | given_))


LEARNED = {"reason": Reason.LEARNED, "q_values": [0.5, 0.46, -1.0]}
HIDDEN: dict[str, Any] = {"hidden": True, "vehicle_id": None, "reason": Reason.HIDDEN_VEHICLE}
LEADER: dict[str, Any] = {"critical": Critical.AHEAD, "ahead_m": 9.04, "speed_mps": 0.5}


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({}, ("STOP: vehicle 17 reaches conflict zone of lane 3 in 2.1 s, leaving takes 3.4 s with "
             "SLOW (gap wanted 3.0 s)")),
        ({"merging": True}, ("STOP: vehicle 17 reaches merging zone of lane 3 in 2.1 s, leaving "
             "takes 3.4 s with SLOW (gap wanted 3.0 s)")),
        ({"critical": Critical.IN_ZONE}, ("STOP: vehicle 17 is in conflict zone of lane 3, leaving "
             "takes 3.4 s with SLOW (gap wanted 3.0 s)")),
        (HIDDEN, ("STOP: lane 3 is hidden beyond 18.0 m, a vehicle there arrives in 2.1 s, leaving "
             "takes 3.4 s with SLOW (gap wanted 3.0 s)")),
        (HIDDEN | {"merging": True, "critical": Critical.IN_ZONE}, ("STOP: a vehicle may hide in "
             "merging zone of lane 3, leaving takes 3.4 s with SLOW (gap wanted 3.0 s)")),
        (LEADER | {"verdict": Verdict.TOO_CLOSE, "lacking_s": math.nan}, ("STOP: vehicle 17 from "
             "lane 3 drives 9.0 m ahead at 0.5 m/s, too close for SLOW")),
        (LEADER | {"verdict": Verdict.KEEPS_BACK}, ("STOP: vehicle 17 from lane 3 drives 9.0 m "
             "ahead at 0.5 m/s; keeps back")),
        ({"verdict": Verdict.KEEPS_BACK}, ("STOP: vehicle 17 reaches conflict zone of lane 3 in "
             "2.1 s, leaving takes 3.4 s with SLOW; keeps back for a run-up")),
        ({"action": Action.FAST, "considered": Action.FAST, "verdict": Verdict.LEAVES_IN_TIME,
          "reason": Reason.CLEAR, "reach_s": 8.0}, ("FAST: vehicle 17 reaches conflict zone of "
             "lane 3 in 8.0 s, leaving takes 3.4 s")),
        ({"action": Action.FAST, "considered": Action.FAST, "verdict": Verdict.STOPS_IN_TIME,
          "reason": Reason.CLEAR}, ("FAST: vehicle 17 reaches conflict zone of lane 3 in 2.1 s, "
             "can still stop")),
        ({"merging": True, "verdict": Verdict.NO_WAY_OUT, "gap_wanted_s": math.nan,
          "lacking_s": 1.2, "considered": Action.FAST, "supervision": Supervision.OVERRULED,
          "proposed": Action.FAST}, ("STOP: supervisor overrules FAST; vehicle 17 reaches merging "
             "zone of lane 3 in 2.1 s, leaving takes 3.4 s, 1.2 s of room lacking")),
        ({"margins_s": (-1.0, -0.5, -math.inf), "supervision": Supervision.AGREED,
          "proposed": Action.STOP}, ("STOP: carrying on the last safe plan; vehicle 17 reaches "
             "conflict zone of lane 3 in 2.1 s, leaving takes 3.4 s with SLOW")),
        (LEARNED, ("STOP: rated 0.04 above SLOW; vehicle 17 reaches conflict zone of lane 3 in "
             "2.1 s, leaving takes 3.4 s with SLOW")),
        (LEARNED | {"supervision": Supervision.AGREED, "proposed": Action.STOP}, ("STOP: rated "
             "0.04 above SLOW; vehicle 17 reaches conflict zone of lane 3 in 2.1 s, leaving takes "
             "3.4 s with SLOW; supervisor agrees")),
        (LEARNED | {"action": Action.SLOW, "considered": Action.SLOW, "verdict": Verdict.NO_WAY_OUT,
          "supervision": Supervision.OBJECTED, "proposed": Action.SLOW}, ("SLOW: rated -0.04 above "
             "STOP; supervisor objects; vehicle 17 reaches conflict zone of lane 3 in "
             "2.1 s, leaving takes 3.4 s")),
        ({"critical": Critical.NOBODY, "reason": Reason.CLEAR}, "STOP: no conflict within range"),
        ({"critical": Critical.NOBODY, "reason": Reason.GOAL_REACHED}, "STOP: the goal is reached"),
        ({"critical": Critical.NOBODY, "reason": Reason.FIXED}, ("STOP: the policy always decides "
             "so")),
    ],
)  # fmt: skip
def test_words_by_example(changed: dict[str, Any], words: str) -> None:
    assert sentence(facts(**changed)) == words


SAME_LANE = (Critical.AHEAD, Critical.BEHIND)
TIMES = st.floats(0.0, 99.0)
REASONS = [reason for reason in Reason if not reason.is_fault]


@st.composite
def all_facts(draw: st.DrawFn) -> Facts:
    """Facts as they may come from any policy, and some that none would give."""
    hidden = draw(st.booleans())
    places = [each for each in Critical if not (hidden and each in SAME_LANE)]
    critical = draw(st.sampled_from(places))
    supervision = draw(st.sampled_from(Supervision))
    joint = draw(st.booleans())
    why = Explanation(
        considered=draw(st.sampled_from(Action)),
        verdict=draw(st.sampled_from(Verdict)),
        critical=critical,
        hidden=hidden,
        merging=draw(st.booleans()),
        distance_m=draw(st.floats(-20.0, 200.0)),
        speed_mps=draw(st.floats(-9.0, 40.0)),
        reach_s=draw(TIMES),
        leave_s=draw(TIMES),
        gap_wanted_s=math.nan if joint else draw(st.floats(0.0, 9.0)),
        lacking_s=draw(st.floats(-99.0, 99.0) | st.just(math.inf) | st.just(math.nan)),
        ahead_m=draw(st.floats(0.0, 200.0)) * (-1 if critical is Critical.BEHIND else 1),
        margins_s=draw(st.tuples(*[st.floats(-9.0, 9.0) | st.just(math.nan)] * 3)),
    )
    return Facts(
        action=draw(st.sampled_from(Action)),
        reason=draw(st.sampled_from(REASONS)),
        why=why,
        vehicle_id=None if hidden else draw(st.integers(0, 9999)),
        lane_id=draw(st.integers(-99, 9999)),
        q_values=draw(st.tuples(*[st.floats(-1.0, 1.0).map(lambda q: round(q, 4))] * 3)),
        supervision=supervision,
        proposed=None if supervision is Supervision.OFF else draw(st.sampled_from(Action)),
    )


@settings(max_examples=300, deadline=None)
@given(all_facts())
def test_every_number_in_the_words_is_that_of_its_field(given_: Facts) -> None:
    said = read(sentence(given_))
    lead = said.pop("lead", None)
    for name, value in said.items():
        field = getattr(given_.why, name, None)
        field = getattr(given_, name) if field is None else field
        field = abs(field) if name == "ahead_m" else field
        assert value == pytest.approx(field, abs=0.0500001), name
    if lead is not None:
        rest = [q for action, q in enumerate(given_.q_values) if action != given_.action]
        assert lead == pytest.approx(given_.q_values[given_.action] - max(rest), rel=0.06)


@settings(max_examples=300, deadline=None)
@given(all_facts())
def test_whoever_is_critical_is_named_with_what_makes_them_so(given_: Facts) -> None:
    text = sentence(given_)
    said, why = read(text), given_.why
    if why.critical is Critical.NOBODY:
        assert said.keys() <= {"lead"}
        return
    assert "lane_id" in said
    assert ("vehicle_id" in said) is not why.hidden
    assert ("reach_s" in said) == (why.critical is Critical.APPROACHING)
    assert ("ahead_m" in said) == (why.critical in SAME_LANE)
    assert (" m behind" in text) == (why.critical is Critical.BEHIND)
    assert ("distance_m" in said) == (why.hidden and why.critical is Critical.APPROACHING)
    assert ("leave_s" in said) == (
        why.critical not in SAME_LANE and why.verdict is not Verdict.STOPS_IN_TIME
    )
    if why.critical not in SAME_LANE:
        assert ("merg" in text) == why.merging


@settings(max_examples=300, deadline=None)
@given(all_facts())
def test_a_text_is_one_short_line_that_begins_with_the_action(given_: Facts) -> None:
    text = sentence(given_)
    assert text.startswith(f"{given_.action.name}: ")
    assert "\n" not in text
    assert "nan" not in text
    assert "inf" not in text
    assert "  " not in text
    assert len(text) <= 180  # with the longest of everything at once


@settings(max_examples=200, deadline=None)
@given(all_facts())
def test_what_a_supervisor_says_is_told(given_: Facts) -> None:
    text = sentence(given_)
    carried_on = given_.why.no_action_is_sound
    assert ("carrying on the last safe plan" in text) == carried_on
    for verdict, words in ((Supervision.OVERRULED, "overrules"), (Supervision.OBJECTED, "objects")):
        told = given_.supervision is verdict and not carried_on
        assert (words in text) == told
        if told and given_.proposed is not None:
            assert verdict is Supervision.OBJECTED or f"overrules {given_.proposed.name}" in text
