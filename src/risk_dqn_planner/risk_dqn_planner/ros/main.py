# SPDX-License-Identifier: Apache-2.0
"""Life and death of a node's process: one clear line for a user's mistake, exit code 0 when asked.

Asked to end means SIGINT or SIGTERM, at any time, also while the node still starts.
"""

import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import Future, wait
from threading import Thread
from types import FrameType

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, try_shutdown

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.ros.background import spinning
from risk_dqn_planner.ros.lifecycle import LOOK_AGAIN_S, ManagedNode


def run(name: str, create: Callable[[], Node]) -> int:
    """Create a node and spin it until it is asked to end; return the exit code."""
    rclpy.init()
    node = None
    try:
        node = create()
        if ok():
            rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except PlannerError as error:
        get_logger(name).fatal(str(error))
        return 1
    except Exception:
        # rclpy calls fail in many ways once a signal has shut its context down.
        if ok():
            raise
    finally:
        # Launchers and terminals send SIGINT twice; the second one must not disturb the end.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if node is not None:
            node.destroy_node()
        try_shutdown()
    return 0


def run_managed(name: str, create: Callable[[], ManagedNode]) -> int:
    """Create a managed node and serve it until it is shut down or asked to end; the exit code.

    It is served in a thread of its own, and a request to end raises nothing: what loads a policy is
    full of foreign code, some of which brings the process down if an exception interrupts it.
    """
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node, serving = None, None
    asked = _requests_to_end()
    try:
        node = create()
        with spinning(node) as executor:
            serving = _in_background(lambda: node.serve(executor, asked))
            while not asked() and not serving.done():
                wait([serving], LOOK_AGAIN_S)
            wait([serving], 2 * LOOK_AGAIN_S)
        if not asked():
            serving.result()
    except PlannerError as error:
        get_logger(name).fatal(" ".join(str(error).split()))
        return 1
    finally:
        if node is not None:
            node.destroy_node()
        try_shutdown()
        sys.stdout.flush()
        if serving is not None and not serving.done():
            # It is in the middle of loading, which nothing can end but the end of the process.
            os._exit(0)
    return 0


def _in_background(work: Callable[[], None]) -> "Future[None]":
    """Do work in a thread that does not keep the process alive."""
    done: Future[None] = Future()

    def run() -> None:
        try:
            work()
        except Exception as error:  # noqa: BLE001 (raised again where it is waited for)
            done.set_exception(error)
        else:
            done.set_result(None)

    Thread(target=run, name="transitions", daemon=True).start()
    return done


def _requests_to_end() -> Callable[[], bool]:
    """Return what tells whether there was a SIGINT or SIGTERM.

    Launchers and terminals send SIGINT twice; neither one disturbs what goes on.
    """
    asked: list[int] = []

    def handle(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 (a handler)
        asked.append(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handle)
    return lambda: bool(asked)
