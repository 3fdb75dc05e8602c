# SPDX-License-Identifier: Apache-2.0
"""What the benchmark computes from its measurements; nothing is measured here."""

import json
from itertools import count
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from bench import sumo_net
from bench.report import Goal, Report, Section
from bench.success import Reached
from bench.timing import in_turns, latency
from bench.training import compare, typical


@pytest.mark.parametrize(
    ("goal", "reached"),
    [
        (Goal("faster", 50.0, 50.0), True),
        (Goal("faster", 49.9, 50.0), False),
        (Goal("faster, not measured", None, 50.0), None),
        (Goal("in time", 5.1, 5.0, at_most=True), False),
        (Goal("in time", 5.0, 5.0, at_most=True), True),
        (Goal("peer never arrived", 12.0, 10.0, lower_bound=True), True),
        (Goal("peer was stopped too soon to tell", 3.0, 10.0, lower_bound=True), None),
    ],
)
def test_a_goal_is_reached_missed_or_unknown(goal: Goal, reached: bool | None) -> None:
    assert goal.reached is reached


def test_a_report_holds_figures_ratios_and_what_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "out" / "bench.json"
    report = Report({"versions": {"python": "3.12.3"}})
    report.sections["simulator"] = Section(
        figures={"steps_per_s": 123456.78},
        ratios=(Goal("ours over theirs", 51.0, 50.0),),
        missing={"libsumo": "no network"},
    )

    report.write(path, complete=True)

    assert json.loads(path.read_text()) == {
        "complete": True,
        "versions": {"python": "3.12.3"},
        "figures": {"simulator": {"steps_per_s": 123460.0}},
        "ratios": {
            "ours over theirs": {"value": 51.0, "goal": {"at_least": 50.0}, "reached": True}
        },
        "goals": {},
        "notes": {"simulator": []},
        "missing": {"libsumo": "no network"},
    }
    assert list(path.parent.iterdir()) == [path]
    assert "ours over theirs" in report.table()
    assert "without libsumo: no network" in report.table()


def test_a_report_that_cannot_be_written_leaves_the_last_one(tmp_path: Path) -> None:
    path = tmp_path / "bench.json"
    path.write_text("the last one")
    report = Report({})
    report.sections["broken"] = Section(figures={"speed": float("nan")})

    with pytest.raises(ValueError, match="JSON"):
        report.write(path, complete=True)

    assert path.read_text() == "the last one"


def test_contestants_take_turns_and_their_median_counts() -> None:
    turns = []
    numbers = iter([1.0, 10.0, 9.0, 30.0, 2.0, 20.0])

    def measured_by(name: str) -> float:
        turns.append(name)
        return next(numbers)

    medians = in_turns({"a": lambda: measured_by("a"), "b": lambda: measured_by("b")}, rounds=3)

    assert turns == ["a", "b"] * 3
    assert medians == {"a": 2.0, "b": 20.0}


def test_latency_is_taken_from_every_call_after_the_first_ten(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock_s, calls = [0.0], count(1)
    monkeypatch.setattr("bench.timing.time.thread_time", lambda: clock_s[0])

    def work() -> None:
        """Call k takes k milliseconds."""
        clock_s[0] += 1e-3 * next(calls)

    took = latency(work, repetitions=101)  # calls 11 to 111

    assert took.p50_ms == pytest.approx(61.0)
    assert took.p99_ms == pytest.approx(110.0)


def reached(**seconds_to: float) -> Reached:
    run = Reached(cpu_s=200.0)
    for name, seconds in seconds_to.items():
        run.look(int(name[2:]) / 100, seconds, seconds, steps=1)
    run.cpu_s = 200.0
    return run


def test_a_level_counts_from_the_first_validation_that_shows_it() -> None:
    run = Reached()
    for cpu_s, success in [(1.0, 0.5), (2.0, 0.92), (3.0, 0.85), (4.0, 0.96)]:
        run.look(success, cpu_s, 2.0 * cpu_s, steps=int(cpu_s) * 100)

    assert [run.seconds_to(level) for level in (0.8, 0.9, 0.95, 0.99)] == [2.0, 2.0, 4.0, None]
    assert (run.best, run.done) == (0.96, False)
    assert run.document()["success_95%"] == {
        "cpu_s": 4.0,
        "wall_s": 8.0,
        "environment_steps": 400,
    }


def test_our_time_is_the_median_over_seeds_that_must_all_arrive() -> None:
    runs = [reached(to99=9.0), reached(to99=30.0), reached(to99=11.0)]

    assert typical(runs, 0.99) == 11.0
    assert typical([*runs, reached(to90=5.0)], 0.99) is None


def test_the_peers_fastest_setup_counts_or_the_time_it_was_given() -> None:
    peers = [reached(to90=60.0), reached(to90=40.0)]

    assert compare(10.0, peers, 0.9).value == 4.0
    never = compare(10.0, peers, 0.99)
    assert (never.value, never.lower_bound, never.reached) == (20.0, True, True)
    assert compare(10.0, [], 0.99).value is None


# Arms 0 east, 1 north, 2 west, 3 south; a vehicle from the south going north is (3, 1).
@pytest.mark.parametrize(
    ("one", "other", "meet", "gives_way"),
    [
        ((3, 1), (0, 2), True, True),  # minor road against the priority road
        ((0, 2), (3, 1), True, False),
        ((3, 1), (1, 3), False, False),  # opposite lanes
        ((3, 0), (2, 0), True, True),  # both end in the east
        ((2, 1), (0, 2), True, True),  # left turn against oncoming traffic
        ((3, 1), (3, 0), False, False),  # one after the other from the same lane
    ],
)
def test_who_gives_way_on_the_crossing_for_sumo(
    one: sumo_net.Movement, other: sumo_net.Movement, meet: bool, gives_way: bool
) -> None:
    assert sumo_net.crosses(one, other) is meet
    assert sumo_net.crosses(other, one) is meet
    assert sumo_net.yields(one, other) is gives_way


def test_of_two_that_meet_exactly_one_gives_way() -> None:
    pairs = [(a, b) for a in sumo_net.MOVEMENTS for b in sumo_net.MOVEMENTS]
    for a, b in pairs:
        assert sumo_net.yields(a, b) + sumo_net.yields(b, a) == sumo_net.crosses(a, b)


def test_lanes_of_the_network_join_end_to_end() -> None:
    net = ET.fromstring(sumo_net.network())  # noqa: S314 (our own)
    shapes = {lane.get("id"): lane.get("shape", "").split() for lane in net.iter("lane")}
    for connection in net.iter("connection"):
        if via := connection.get("via"):
            assert shapes[f"{connection.get('from')}_0"][-1] == shapes[via][0]
            assert shapes[via][-1] == shapes[f"{connection.get('to')}_0"][0]
