# SPDX-License-Identifier: Apache-2.0
"""A node that goes on serving its timers while its own thread is busy."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node


@contextmanager
def spinning(node: Node) -> Iterator[None]:
    """Run a node's callbacks in a thread of their own; afterwards nobody runs them.

    The caller keeps the main thread, which is the one that a request to end interrupts.
    """
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)

    def spin() -> None:
        try:
            with suppress(ExternalShutdownException):
                executor.spin()
        except Exception:
            # rclpy calls fail in many ways once a signal has shut its context down.
            if node.context.ok():
                raise

    thread = threading.Thread(target=spin, name=f"{node.get_name()} callbacks", daemon=True)
    thread.start()
    try:
        yield
    finally:
        executor.shutdown()
        thread.join()
