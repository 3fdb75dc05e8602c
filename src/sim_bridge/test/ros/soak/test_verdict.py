# SPDX-License-Identifier: Apache-2.0
import json
from collections import Counter
from pathlib import Path

import pytest

from sim_bridge.ros.soak.ledger import Ledger
from sim_bridge.ros.soak.pictures import draw_memory
from sim_bridge.ros.soak.processes import Usage
from sim_bridge.ros.soak.trend import Limits
from sim_bridge.ros.soak.verdict import Sample, Soak, write_json

MB = 1_000_000


def soak(
    leak_mb_per_h: float = 0.0,
    ledger: Ledger | None = None,
    extra_threads: int = 0,
    hours: float = 1.0,
    died: str = "",
) -> Soak:
    samples = [
        Sample(
            36.0 * k * hours,
            {
                "policy_node": Usage(
                    int((400 + leak_mb_per_h * hours * k / 100) * MB),
                    14 + (extra_threads if k > 60 else 0),
                    18,
                ),
                "situation_node": Usage(200 * MB, 12, 17),
            },
        )
        for k in range(101)
    ]
    good = Ledger(episodes=Counter(success=9), decisions=700, longest_gap_s=0.5)
    return Soak(samples, ledger or good, Counter(), 360.0, died)


def test_flat_memory_and_unbroken_decisions_pass() -> None:
    assert soak().complaints(Limits()) == []
    assert soak(leak_mb_per_h=4.0).complaints(Limits()) == []


def test_a_process_that_leaks_is_named_with_its_growth() -> None:
    (complaint,) = soak(leak_mb_per_h=10.0).complaints(Limits())
    assert complaint == (
        "policy_node grows by 8.0 MB in an hour or the whole run, expected at most 5"
    )


def test_a_leak_that_nearly_doubles_a_small_process_shows_in_its_ratio() -> None:
    many = soak(leak_mb_per_h=4.0)
    small = [
        Sample(s.driven_s, {"tiny_node": Usage(2 * MB + k * 40_000, 3, 4)})
        for k, s in enumerate(many.samples)
    ]
    complaints = Soak(small, many.ledger, Counter(), 1.0).complaints(Limits())
    assert len(complaints) == 1
    assert complaints[0].startswith("tiny_node ends with 1.9")


def test_more_threads_than_after_the_warm_up_are_named() -> None:
    (complaint,) = soak(extra_threads=1).complaints(Limits())
    assert complaint == "policy_node has 15 threads, and 14 after the warm-up"


@pytest.mark.parametrize(
    ("ledger", "complaint"),
    [
        (Ledger(), "no episode ended"),
        (
            Ledger(episodes=Counter(success=1), longest_gap_s=1.5),
            "no decision for 1.5 s of simulated time within an episode, expected at most 1 s",
        ),
        (
            Ledger(episodes=Counter(success=1), faults=Counter(OFF_ROUTE=2)),
            "decisions within episodes were Stop for a fault: 2 x OFF_ROUTE",
        ),
    ],
)
def test_what_is_missing_or_doubtful_is_named(ledger: Ledger, complaint: str) -> None:
    assert soak(ledger=ledger).complaints(Limits()) == [complaint]


def test_a_gap_of_one_second_is_allowed() -> None:
    ledger = Ledger(episodes=Counter(success=1), longest_gap_s=1.0)
    assert soak(ledger=ledger).complaints(Limits()) == []


def test_a_node_that_died_does_not_pass() -> None:
    assert soak(died="policy_node ended with code -9").complaints(Limits()) == [
        "policy_node ended with code -9"
    ]


def test_a_drive_without_samples_does_not_pass() -> None:
    short = Soak([], Ledger(episodes=Counter(success=1)), Counter(), 0.0)
    assert short.complaints(Limits()) == ["the drive was too short to judge the memory"]


def test_everything_is_written_with_its_limits_and_a_picture(tmp_path: Path) -> None:
    write_json(tmp_path / "soak.json", soak().document(Limits(), {"policy": "tuned"}))
    draw_memory(soak(), Limits(), "tuned", tmp_path / "memory.png")
    found = json.loads((tmp_path / "soak.json").read_text())
    assert found["passed"] is True
    assert (found["simulated_h"], found["real_time_factor"]) == (1.0, 10.0)
    assert found["policy"] == "tuned"
    assert found["processes"]["policy_node"]["memory_mb"]["after_warm_up"] == 400.0
    assert found["limits"]["growth_mb"] == 5.0
    assert len(found["series"]["driven_s"]) == 101
    assert (tmp_path / "memory.png").stat().st_size > 5000
