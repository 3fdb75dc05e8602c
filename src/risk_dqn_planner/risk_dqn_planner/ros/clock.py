# SPDX-License-Identifier: Apache-2.0
"""Simulated and real time: what jumps, what stands still, and timers for either."""

from collections.abc import Callable

from rclpy.clock import Clock, JumpHandle, JumpThreshold, TimeJump
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.timer import Timer

# A simulated clock that waits for the answers to inputs stands this far behind them at most [s].
SIMULATED_LEAD_S = 0.5


def now_ns(node: Node) -> int:
    """Return the time of the node's clock, the one that stamps are compared with [ns]."""
    return int(node.get_clock().now().nanoseconds)


def is_simulated(node: Node) -> bool:
    """Tell whether the node's time comes from /clock."""
    return bool(node.get_parameter("use_sim_time").value)


def allowed_lead_s(node: Node, lead_s: float) -> float:
    """Return how far inputs may be ahead of the node's clock, if in real time it is `lead_s`."""
    return max(lead_s, SIMULATED_LEAD_S) if is_simulated(node) else lead_s


def on_clock_back(node: Node, react: Callable[[], None]) -> JumpHandle:
    """Call `react` whenever the node's clock has jumped back, as it does when a bag restarts.

    The handle must be kept for as long as that is wanted.
    """

    def jumped(jump: TimeJump) -> None:
        if jump.delta.nanoseconds < 0:
            react()

    threshold = JumpThreshold(
        min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False
    )
    return node.get_clock().create_jump_callback(threshold, post_callback=jumped)


def steady_timer(node: Node, period_s: float, react: Callable[[], None]) -> Timer:
    """Return a timer that also runs while simulated time stands still."""
    return node.create_timer(period_s, react, clock=Clock(clock_type=ClockType.STEADY_TIME))
