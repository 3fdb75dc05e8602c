# SPDX-License-Identifier: Apache-2.0
"""A node's callbacks in a thread of their own, so that loading a policy silences nobody."""

import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager

from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node


@contextmanager
def spinning(node: Node) -> Iterator[Executor]:
    """Run a node's callbacks in a thread of their own; afterwards nobody runs them.

    A callback that fails is told of, and the others go on.
    """
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    ended = threading.Event()

    def spin_once_more() -> None:
        try:
            executor.spin()
        except ExternalShutdownException:
            return
        except Exception:  # noqa: BLE001 (a vehicle needs its decisions, whatever fails)
            if not ended.is_set() and node.context.ok():
                node.get_logger().error(traceback.format_exc(), throttle_duration_sec=10.0)

    def spin() -> None:
        while not ended.is_set() and node.context.ok():
            spin_once_more()

    thread = threading.Thread(target=spin, name=f"{node.get_name()} callbacks", daemon=True)
    thread.start()
    try:
        yield executor
    finally:
        ended.set()
        executor.shutdown(timeout_sec=5.0)
        thread.join(timeout=5.0)
