# SPDX-License-Identifier: Apache-2.0
import threading
import time

import pytest
from intersection_msgs.msg import Decision, Situation

from risk_dqn_planner.ros.conversions import to_ns, to_stamp
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.pacing import LockStep, RealTime, WallPace
from sim_bridge.ros.planner_link import DECISION_PERIOD_NS, Mailbox

LONG_S = 30.0  # a test that waits this long has failed


class FakeLink:
    """Stands in for PlannerLink; answers with what the test prepared for each time."""

    def __init__(self) -> None:
        self.situations: Mailbox[Situation] = Mailbox()
        self.decisions: Mailbox[Decision] = Mailbox()
        self.answers: dict[int, list[Decision]] = {}
        self.log: list[str] = []
        self.closed = False

    def tick(self, stamp_ns: int) -> None:
        newest, _ = self.situations.newest()
        self.log.append(f"clock {stamp_ns} with situation {newest}")
        for answer in self.answers.get(stamp_ns, []):
            self.decisions.put(to_ns(answer.header.stamp), answer)

    def close(self) -> None:
        self.closed = True
        self.situations.close()
        self.decisions.close()


def decision(stamp_ns: int, situation_ns: int) -> Decision:
    message = Decision(action=Decision.FAST, situation_stamp=to_stamp(situation_ns))
    message.header.stamp = to_stamp(stamp_ns)
    return message


def test_stamps_survive_the_way_to_a_message_and_back() -> None:
    assert to_ns(to_stamp(123_456_789_012)) == 123_456_789_012
    assert to_stamp(1_500_000_000).nanosec == 500_000_000


def test_a_mailbox_hands_out_only_the_stamp_that_was_asked_for() -> None:
    box: Mailbox[str] = Mailbox()
    box.put(5, "five")
    assert box.wait(5, 0.0) == "five"
    assert box.wait(4, LONG_S) is None  # already past: no use in waiting
    assert box.wait(6, 0.0) is None
    assert box.newest() == (5, "five")


def test_a_mailbox_wakes_its_reader() -> None:
    box: Mailbox[str] = Mailbox()
    threading.Timer(0.05, box.put, (7, "seven")).start()
    assert box.wait(7, LONG_S) == "seven"


def test_a_closed_mailbox_keeps_nobody_waiting() -> None:
    box: Mailbox[str] = Mailbox()
    threading.Timer(0.05, box.close).start()
    started = time.monotonic()
    assert box.wait(1, LONG_S) is None
    assert time.monotonic() - started < LONG_S / 2


def test_in_lock_step_the_clock_waits_for_the_situation() -> None:
    link = FakeLink()
    threading.Timer(0.05, link.situations.put, (100, Situation())).start()
    LockStep(link, WallPace(0.0), LONG_S).reach(100)
    assert link.log == ["clock 100 with situation 100"]


def test_in_lock_step_a_planner_that_stays_silent_is_waited_for_only_so_long() -> None:
    link = FakeLink()
    pacing = LockStep(link, WallPace(0.0), 0.05)
    pacing.reach(DECISION_PERIOD_NS)
    assert link.log == [f"clock {DECISION_PERIOD_NS} with situation -1"]
    assert pacing.decision(DECISION_PERIOD_NS) is None


def test_in_lock_step_nothing_is_waited_for_that_cannot_come() -> None:
    link = FakeLink()
    pacing = LockStep(link, WallPace(0.0), LONG_S)
    started = time.monotonic()
    # Without objects there is no situation, and the decision is taken on an earlier one.
    link.answers = {DECISION_PERIOD_NS: [decision(DECISION_PERIOD_NS, 300_000_000)]}
    pacing.reach(DECISION_PERIOD_NS, complete=False)
    assert pacing.decision(DECISION_PERIOD_NS) == decision(DECISION_PERIOD_NS, 300_000_000)
    assert time.monotonic() - started < LONG_S / 2


def test_in_lock_step_only_a_decision_on_the_present_situation_counts() -> None:
    link = FakeLink()
    pacing = LockStep(link, WallPace(0.0), 0.5)
    first, second = DECISION_PERIOD_NS, 2 * DECISION_PERIOD_NS
    link.answers = {first: [decision(first, first)], second: [decision(second, second - 1)]}
    link.tick(first)
    assert pacing.decision(first) == decision(first, first)
    link.tick(second)
    assert pacing.decision(second) is None


def test_in_lock_step_a_decision_holds_until_the_next_is_due() -> None:
    link = FakeLink()
    pacing = LockStep(link, WallPace(0.0), 0.05)
    start = DECISION_PERIOD_NS
    link.answers = {start: [decision(start, start)]}
    link.tick(start)
    assert pacing.decision(start) == decision(start, start)
    assert pacing.decision(start + 100_000_000) == decision(start, start)
    assert pacing.decision(start + DECISION_PERIOD_NS) is None


def test_in_lock_step_a_lost_clock_message_is_sent_again() -> None:
    link = FakeLink()
    link.answers = {DECISION_PERIOD_NS: [decision(DECISION_PERIOD_NS, DECISION_PERIOD_NS)]}
    # `reach` has ticked, but nobody heard it.
    found = LockStep(link, WallPace(0.0), LONG_S).decision(DECISION_PERIOD_NS)
    assert found == decision(DECISION_PERIOD_NS, DECISION_PERIOD_NS)


def test_in_real_time_the_newest_decision_counts_until_it_is_a_second_old() -> None:
    link = FakeLink()
    pacing = RealTime(link, WallPace(0.0))
    assert pacing.decision(SECOND_NS * 2) is None
    link.decisions.put(SECOND_NS, decision(SECOND_NS, 0))
    assert pacing.decision(SECOND_NS * 2) == decision(SECOND_NS, 0)
    assert pacing.decision(SECOND_NS * 2 + 1) is None


@pytest.mark.parametrize(("factor", "least_s"), [(1.0, 0.2), (4.0, 0.05), (0.0, 0.0)])
def test_simulated_time_runs_at_most_at_the_given_factor(factor: float, least_s: float) -> None:
    pace = WallPace(factor)
    started = time.monotonic()
    for stamp_ns in range(0, 300_000_000, 100_000_000):
        pace.reach(stamp_ns)
    elapsed_s = time.monotonic() - started
    assert least_s <= elapsed_s < least_s + 1.0


def test_in_lock_step_a_pause_jumps_to_the_last_decision_before_the_next_frame() -> None:
    link = FakeLink()
    times = [n * DECISION_PERIOD_NS for n in range(5)]
    link.answers = {times[3]: [decision(times[3], 0)]}
    pacing = LockStep(link, WallPace(0.0), LONG_S)
    pacing.pause(times[0], times[4])
    assert link.log == [f"clock {times[3]} with situation -1"]
    pacing.pause(times[4], times[4] + 1)  # nothing is due in between
    assert len(link.log) == 1


def test_in_real_time_a_pause_lets_the_clock_go_on() -> None:
    link = FakeLink()
    RealTime(link, WallPace(0.0)).pause(0, 400_000_000)
    assert [entry.split()[1] for entry in link.log] == ["100000000", "200000000", "300000000"]
