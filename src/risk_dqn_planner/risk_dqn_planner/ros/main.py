# SPDX-License-Identifier: Apache-2.0
"""Life and death of a node's process: one clear line for a user's mistake, exit code 0 when asked.

Asked to end means SIGINT or SIGTERM, at any time, also while the node still starts.
"""

import signal
from collections.abc import Callable

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.utilities import ok, try_shutdown

from risk_dqn_planner.errors import PlannerError


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
