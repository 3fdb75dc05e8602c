# SPDX-License-Identifier: Apache-2.0
"""Whatever happens to an input, the planner says Stop and why, lives on and recovers by itself."""

from collections.abc import Iterator

import pytest
from fault_cases import CASES, NEXT_DECISION_S, RECOVERY_S, Case
from fault_driver import SIMULATED, FaultDriver, fault_nodes
from fault_verdict import complaints

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


def test_after_all_that_both_nodes_end_when_asked_and_have_not_raised(
    driver: FaultDriver,
) -> None:
    for name, (code, output) in driver.nodes.end().items():
        assert code == 0, name
        assert "Traceback" not in output, output
