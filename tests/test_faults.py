# SPDX-License-Identifier: Apache-2.0
"""Whatever happens to an input, the planner says Stop and why, lives on and recovers by itself."""

import random
import time
from collections.abc import Iterator
from itertools import pairwise

import pytest
from fault_cases import CASES, NEXT_DECISION_S, RECOVERY_S, Case, Told
from fault_driver import SIMULATED, STEP_NS, FaultDriver, fault_nodes
from fault_fuzz import fuzzed
from fault_verdict import complaints, told_by
from intersection_msgs.msg import Decision
from rclpy.serialization import serialize_message

from risk_dqn_planner.decision import Reason
from risk_dqn_planner.faults import FaultyInput

pytestmark = pytest.mark.ros

BUSY_S = 0.3  # for a computer that has more to do
WILD_FRAMES, WILD_MESSAGES = 50, 10  # on each of five topics


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultDriver]:
    with fault_nodes(tmp_path_factory.mktemp("faults"), SIMULATED) as running:
        driver = FaultDriver(*running)
        driver.meet()
        yield driver


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.title)
def test_a_fault_is_answered_with_stop_and_its_reason_until_it_is_over(
    driver: FaultDriver, case: Case
) -> None:
    reaction = driver.suffer(case)
    driver.nodes.check()
    assert complaints(case, reaction) == []


@pytest.mark.parametrize("by_s", [-5.0, 5.0], ids=["back", "ahead"])
def test_when_the_clock_jumps_and_all_inputs_with_it_the_ego_soon_drives_on(
    driver: FaultDriver, by_s: float
) -> None:
    driver.begin()
    driver.jump(by_s, by_s)
    driver.recover(RECOVERY_S + NEXT_DECISION_S)


@pytest.mark.parametrize(
    ("by_s", "reason"),
    [(-5.0, Decision.FUTURE_INPUT), (5.0, Decision.STALE_INPUT)],
    ids=["back", "ahead"],
)
def test_when_the_clock_jumps_and_the_inputs_do_not_the_ego_stops_until_they_agree(
    driver: FaultDriver, by_s: float, reason: int
) -> None:
    driver.begin()
    began = len(driver.ears.decisions)
    driver.jump(by_s, 0.0)
    for _ in range(15):
        driver.step()
    said = driver.ears.decisions[began:]
    driver.jump(-by_s, 0.0)
    driver.recover(RECOVERY_S + NEXT_DECISION_S)
    assert {d.action for d in said[1:]} == {Decision.STOP}
    assert said[-1].reason == reason


@pytest.mark.parametrize("inputs_come", [False, True], ids=["inputs stop", "inputs go on"])
def test_when_the_clock_stands_the_ego_stops_and_is_told_so_twice_a_second(
    driver: FaultDriver, inputs_come: bool
) -> None:
    driver.begin()
    driver.set_clock_timeout(0.5)
    driver.step()
    began, stood_s = len(driver.ears.decisions), time.monotonic()
    try:
        while time.monotonic() < stood_s + 3.0:
            if inputs_come:
                driver.now_ns += STEP_NS
                driver.publish()
            time.sleep(0.1)
    finally:
        driver.set_clock_timeout(30.0)
    said, arrivals_s = driver.ears.decisions[began:], driver.ears.arrivals_s[began:]
    assert {d.action for d in said} == {Decision.STOP}
    assert told_by(said[-1]) == Told(Reason.FROZEN_INPUT, FaultyInput.CLOCK)
    assert max(b - a for a, b in pairwise([stood_s, *arrivals_s])) < 1.0 + BUSY_S
    driver.recover(8.0)


def test_thousands_of_wild_messages_neither_end_nor_silence_the_nodes(
    driver: FaultDriver,
) -> None:
    driver.begin()
    chance = random.Random(5)  # noqa: S311 (no secret)
    driver.step()
    good = {**driver.healthy(), **driver.latest()}
    good[FaultyInput.VISIBLE_AREA].polygon.points = good[FaultyInput.VISIBLE_AREA].polygon.points[
        ::6
    ]
    for _ in range(WILD_FRAMES):
        for source, publisher in driver.publishers.items():
            for _ in range(WILD_MESSAGES):
                publisher.publish(fuzzed(good[source], chance))
        driver.step()
    driver.nodes.check()
    driver.begin()


def test_messages_that_are_cut_short_neither_end_nor_silence_the_nodes(
    driver: FaultDriver,
) -> None:
    driver.begin()
    chance = random.Random(6)  # noqa: S311 (no secret)
    driver.step()
    for _ in range(10):
        for source, message in {**driver.healthy(), **driver.latest()}.items():
            data = serialize_message(message)
            driver.publishers[source].publish(data[: chance.randrange(len(data))])
        driver.step()
    driver.nodes.check()
    driver.begin()


def test_after_all_that_both_nodes_end_when_asked_and_have_not_raised(
    driver: FaultDriver,
) -> None:
    for name, (code, output) in driver.nodes.end().items():
        assert code == 0, name
        assert "Traceback" not in output, output
