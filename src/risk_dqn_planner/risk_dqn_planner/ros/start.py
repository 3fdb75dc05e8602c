# SPDX-License-Identifier: Apache-2.0
"""Where the executables begin: importing a node takes seconds, and it may be asked to end then."""

import importlib
import os
import signal
from types import FrameType


def situation_node() -> int:
    """Run the situation node; the exit code."""
    return _start("risk_dqn_planner.ros.situation_node")


def policy_node() -> int:
    """Run the policy node; the exit code."""
    return _start("risk_dqn_planner.ros.policy_node")


def _start(module: str) -> int:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _end)
    return int(importlib.import_module(module).main())


def _end(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 (a handler)
    """End at once: there is nothing yet that would have to be put in order."""
    os._exit(0)
