# SPDX-License-Identifier: Apache-2.0
"""What a command needs around its work: a node that listens in the background, clean exits."""

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from risk_dqn_planner.errors import PlannerError
from sim_bridge.ros.process import isolate, own_domain

_LOOK_AGAIN_S = 0.02


class SilentPlannerError(PlannerError):
    """Nodes did not find each other or never answered."""


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


@contextmanager
def ros_session(name: str) -> Iterator[Node]:
    """Give a node in a ROS domain of its own, its callbacks running in a background thread.

    Processes started within inherit the domain. A request to terminate becomes a
    KeyboardInterrupt, so that `with` blocks end the processes they have started.
    """
    signal.signal(signal.SIGTERM, _interrupt)
    with own_domain() as domain_id:
        isolate(domain_id)
        with _listening(name) as node:
            yield node


@contextmanager
def _listening(name: str) -> Iterator[Node]:
    context = Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = Node(name, context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin() -> None:
        with suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin, name=f"{name} callbacks", daemon=True)
    thread.start()
    try:
        yield node
    finally:
        executor.shutdown()
        thread.join(timeout=2.0)
        node.destroy_node()
        context.try_shutdown()


def wait_until(
    holds: Callable[[], bool], what: str, timeout_s: float, check: Callable[[], None]
) -> None:
    """Wait until a condition holds; `check` raises if waiting has become pointless.

    Raises:
        SilentPlannerError: it did not hold in time; names `what` was awaited.
    """
    deadline = time.monotonic() + timeout_s
    while not holds():
        check()
        if time.monotonic() > deadline:
            raise SilentPlannerError(f"waited {timeout_s:g} s in vain for {what}")
        time.sleep(_LOOK_AGAIN_S)
