# SPDX-License-Identifier: Apache-2.0
"""Life and death of a node's process: one clear line for a user's mistake, exit code 0 when asked.

Asked to end means SIGINT or SIGTERM, at any time, also while the node still starts.
"""

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, try_shutdown

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.ros.background import spinning
from risk_dqn_planner.ros.lifecycle import ManagedNode


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
    """Create a managed node and serve it until it is shut down or asked to end; the exit code."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = None
    with _requests_to_end() as asked:
        try:
            node = create()
            with spinning(node) as executor:
                try:
                    node.serve(executor, asked)
                finally:
                    _ignore_requests()
        except KeyboardInterrupt:
            pass
        except PlannerError as error:
            get_logger(name).fatal(" ".join(str(error).split()))
            return 1
        except Exception:
            # What is interrupted may fail in its own way.
            if not asked():
                raise
        finally:
            _ignore_requests()
            if node is not None:
                node.destroy_node()
            try_shutdown()
            sys.stdout.flush()
    return 0


def _ignore_requests() -> None:
    """Ask no more whether to end: the process does, and must not be disturbed."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def _requests_to_end() -> Iterator[Callable[[], bool]]:
    """Let the first SIGINT or SIGTERM interrupt the main thread, and ignore the others.

    Launchers and terminals send SIGINT twice; the second one must not disturb the end. Yields what
    tells whether there was one.
    """
    asked: list[int] = []

    def handle(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 (a handler)
        asked.append(number)
        if len(asked) == 1:
            raise KeyboardInterrupt

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handle)
    yield lambda: bool(asked)
