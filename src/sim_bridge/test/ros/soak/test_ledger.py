# SPDX-License-Identifier: Apache-2.0
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.soak.ledger import Ledger

HALF_NS = SECOND_NS // 2


def drive(ledger: Ledger, begin: int, end: int, without: tuple[int, ...] = ()) -> None:
    """One episode with a decision every half second; times in half seconds."""
    ledger.started(begin * HALF_NS)
    for k in range(begin, end + 1):
        if k not in without:
            ledger.decided(k * HALF_NS, None)
    ledger.ended(end * HALF_NS, "success", 0)


def test_decisions_every_half_second_leave_gaps_of_half_a_second() -> None:
    ledger = Ledger()
    drive(ledger, 20, 40)
    ledger.decided(44 * HALF_NS, "STALE_INPUT")
    assert (ledger.longest_gap_s, ledger.decisions, dict(ledger.faults)) == (0.5, 21, {})
    assert dict(ledger.episodes) == {"success": 1}


def test_one_missing_decision_leaves_a_gap_of_a_second_and_two_one_of_1_5_s() -> None:
    for missing, gap_s in (((30,), 1.0), ((30, 31), 1.5)):
        ledger = Ledger()
        drive(ledger, 20, 40, without=missing)
        ledger.started(50 * HALF_NS)
        assert ledger.longest_gap_s == gap_s


def test_an_episode_without_its_first_or_last_decisions_has_a_gap_there() -> None:
    for missing in ((20, 21), (39, 40)):
        ledger = Ledger()
        drive(ledger, 20, 40, without=missing)
        ledger.started(50 * HALF_NS)
        assert ledger.longest_gap_s == 1.0


def test_time_between_episodes_counts_neither_as_gap_nor_as_fault() -> None:
    ledger = Ledger()
    drive(ledger, 20, 40)
    ledger.decided(60 * HALF_NS, "STALE_INPUT")
    drive(ledger, 100, 120)
    ledger.started(200 * HALF_NS)
    assert (ledger.longest_gap_s, dict(ledger.faults), ledger.decisions) == (0.5, {}, 42)
    assert ledger.episodes["success"] == 2


def test_faults_within_an_episode_are_counted_by_reason() -> None:
    ledger = Ledger()
    ledger.started(0)
    for k, fault in enumerate((None, "OFF_ROUTE", "OFF_ROUTE", "POLICY_FAILED", None)):
        ledger.decided(k * HALF_NS, fault)
    ledger.ended(4 * HALF_NS, "timeout", 3)
    ledger.started(100 * HALF_NS)
    assert dict(ledger.faults) == {"OFF_ROUTE": 2, "POLICY_FAILED": 1}
    assert ledger.late == 3


def test_a_decision_that_arrives_after_the_end_of_its_episode_still_belongs_to_it() -> None:
    ledger = Ledger()
    ledger.started(0)
    for k in range(4):
        ledger.decided(k * HALF_NS, None)
    ledger.ended(4 * HALF_NS, "success", 0)
    ledger.decided(4 * HALF_NS, None)
    assert ledger.decisions == 0  # not judged yet
    ledger.decided(8 * HALF_NS, "STALE_INPUT")
    assert (ledger.decisions, ledger.longest_gap_s) == (5, 0.5)


def test_decisions_before_the_start_message_arrives_count_from_its_stamp() -> None:
    ledger = Ledger()
    ledger.decided(20 * HALF_NS, None)
    drive(ledger, 20, 22, without=(20,))
    ledger.started(100 * HALF_NS)
    assert (ledger.decisions, ledger.longest_gap_s) == (3, 0.5)
