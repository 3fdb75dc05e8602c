# SPDX-License-Identifier: Apache-2.0
import time
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.node import Node

from risk_dqn_planner.ros.ticker import Ticker


class Decisions:
    """Notes when decisions were asked for."""

    def __init__(self) -> None:
        self.asked: list[int] = []

    def decide(self, stamp_ns: int) -> None:
        self.asked.append(stamp_ns)

    def has_reached(self, stamp_ns: int) -> bool:
        return stamp_ns >= 0

    def clock_stands(self, stamp_ns: int, stood_s: float) -> None:
        raise AssertionError(f"real time does not stand at {stamp_ns} for {stood_s}")


@pytest.fixture
def node() -> Iterator[Node]:
    rclpy.init()
    node = Node("ticking")
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def test_who_starts_it_again_and_again_does_not_put_decisions_off(node: Node) -> None:
    decisions = Decisions()
    ticker = Ticker(node, decisions)
    deadline = time.monotonic() + 1.2
    while time.monotonic() < deadline:
        ticker.start(5.0, 0.2)
        rclpy.spin_once(node, timeout_sec=0.05)
    assert 4 <= len(decisions.asked) <= 6


def test_it_goes_on_at_another_rate_and_ends(node: Node) -> None:
    decisions = Decisions()
    ticker = Ticker(node, decisions)
    ticker.start(0.1, 0.2)
    ticker.start(20.0, 0.2)
    assert ticker.running
    deadline = time.monotonic() + 5.0
    while len(decisions.asked) < 3 and time.monotonic() < deadline:
        rclpy.spin_once(node, timeout_sec=0.05)
    assert len(decisions.asked) == 3
    ticker.stop()
    assert not ticker.running
    rclpy.spin_once(node, timeout_sec=0.2)
    assert len(decisions.asked) == 3
