# SPDX-License-Identifier: Apache-2.0
"""A managed node says what is wrong, whatever its transitions do."""

from collections.abc import Iterator

import pytest
import rclpy
from rclpy.lifecycle import TransitionCallbackReturn

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.ros.lifecycle import ManagedNode

ERROR, SUCCESS = TransitionCallbackReturn.ERROR, TransitionCallbackReturn.SUCCESS


class Failing(ManagedNode):
    """Cannot be activated, for no reason that it knows."""

    def __init__(self) -> None:
        super().__init__("failing")
        self.refusals: list[str] = []
        self.done: list[str] = []

    def activate(self) -> None:
        raise RuntimeError("out of luck")

    def deactivate(self) -> None:
        self.done.append("deactivate")

    def clean_up(self) -> None:
        self.done.append("clean up")

    def refuse(self, error: PlannerError) -> None:
        self.refusals.append(str(error))


def failing(*, autostart: bool) -> Failing:
    rclpy.init(args=["--ros-args", "-p", f"autostart:={'true' if autostart else 'false'}"])
    return Failing()


@pytest.fixture(autouse=True)
def _end() -> Iterator[None]:
    yield
    rclpy.try_shutdown()


@pytest.mark.parametrize("autostart", [True, False], ids=["alone", "managed"])
def test_a_transition_that_fails_leads_back_and_nobody_is_left_without_a_word(
    autostart: bool, capfd: pytest.CaptureFixture[str]
) -> None:
    node = failing(autostart=autostart)
    assert node.trigger_configure() == SUCCESS
    assert node.trigger_activate() == ERROR
    assert node.state_name() == "unconfigured"
    assert node.done == ["deactivate", "clean up"]
    # A manager sees the state; without one the node itself must go on saying Stop.
    assert len(node.refusals) == (1 if autostart else 0)
    said = capfd.readouterr()
    assert "out of luck" in said.err + said.out
    node.destroy_node()
