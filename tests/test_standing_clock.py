# SPDX-License-Identifier: Apache-2.0
"""A policy node whose /clock stands, goes on and jumps back: decisions keep coming."""

import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import pytest
from intersection_msgs.msg import Decision
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from risk_dqn_planner.ros import conversions
from risk_dqn_planner.situation.report import SituationReport, Status
from risk_dqn_planner.situation.warm_up import example_situation
from sim_bridge.ros import topics
from sim_bridge.ros.process import NodeCommand, NodeProcess
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.ros.session import wait_until

pytestmark = pytest.mark.ros

MS = 1_000_000
PATIENCE_S = 240.0
STEP_S = 0.05
MAX_SILENCE_S = 1.0


class Driver:
    """Gives a policy node time and situations of each time, as fast as the wall clock."""

    def __init__(self, node: Node) -> None:
        self.now_ms = 0
        self.arrivals: list[tuple[float, Decision]] = []
        self._clock = node.create_publisher(Clock, "/clock", QoSProfile(depth=10))
        self._situations = node.create_publisher(
            topics.SITUATION.message, topics.SITUATION.name, topics.SITUATION.qos
        )
        node.create_subscription(
            Decision, topics.DECISION.name, self._on_decision, topics.DECISION.qos
        )

    def _on_decision(self, decision: Decision) -> None:
        self.arrivals.append((time.monotonic(), decision))

    def newest(self) -> tuple[int, int]:
        """Reason and faulty input of the newest decision."""
        if not self.arrivals:
            return -1, -1
        decision = self.arrivals[-1][1]
        return decision.reason, decision.faulty_input

    def step(self) -> None:
        """Let time go on by 100 ms, half as fast in real time, with a situation of that time."""
        self.now_ms += 100
        report = SituationReport(
            self.now_ms * MS, Status.OK, "", (1,), situations=example_situation()
        )
        self._situations.publish(conversions.situation_to_message(report))
        self._clock.publish(Clock(clock=conversions.to_stamp(self.now_ms * MS)))
        time.sleep(STEP_S)

    def go_on_until(self, reason: int, check: Callable[[], None]) -> None:
        """Let time go on until decisions are taken for a reason."""

        def reached() -> bool:
            self.step()
            return self.newest()[0] == reason

        wait_until(reached, f"reason {reason}, not {self.newest()}", 20.0, check)

    def longest_silence_s(self, since_s: float) -> float:
        """The longest time without a decision since a time, until now."""
        times = [since_s, *(t for t, _ in self.arrivals if t > since_s), time.monotonic()]
        return max(b - a for a, b in pairwise(times))


@pytest.fixture
def process(start: Callable[[NodeCommand], NodeProcess], settings: RunSettings) -> NodeProcess:
    realistic = {"clock_timeout_s": 0.4, "sim_time_patience_s": 0.0}
    chosen = replace(settings, policy="always_fast", supervisor="off", overrides=realistic)
    return start(chosen.planner_commands()[1])


def test_a_clock_that_stands_is_answered_with_stop_and_one_that_jumps_back_is_followed(
    node: Node, process: NodeProcess
) -> None:
    driver = Driver(node)
    no_time = (Decision.MISSING_INPUT, Decision.CLOCK)
    wait_until(lambda: driver.newest() == no_time, "the node", PATIENCE_S, process.check)
    driver.go_on_until(Decision.FIXED, process.check)

    stopped = time.monotonic()
    frozen = (Decision.FROZEN_INPUT, Decision.CLOCK)
    wait_until(lambda: driver.newest() == frozen, "Stop", 5.0, process.check)
    first = len(driver.arrivals)
    wait_until(lambda: len(driver.arrivals) >= first + 3, "decisions", 5.0, process.check)
    assert driver.newest() == frozen
    assert driver.arrivals[-1][1].action == Decision.STOP
    assert "stood still" in driver.arrivals[-1][1].text
    assert driver.longest_silence_s(stopped) < MAX_SILENCE_S

    driver.go_on_until(Decision.RECOVERING, process.check)
    driver.go_on_until(Decision.FIXED, process.check)

    driver.now_ms = 500
    jumped = time.monotonic()
    driver.go_on_until(Decision.FIXED, process.check)
    assert driver.longest_silence_s(jumped) < MAX_SILENCE_S
    assert "Traceback" not in process.output(), process.output()
