# SPDX-License-Identifier: Apache-2.0
"""Situation and policy node as processes that may be killed and started again."""

import os
import signal
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType

from sim_bridge.ros.node_group import uninterrupted
from sim_bridge.ros.process import NodeCommand, NodeProcess


class NodePair:
    """The planner's two nodes; a context manager."""

    def __init__(self, commands: Sequence[NodeCommand], logs: Path) -> None:
        self._commands = {command.executable: command for command in commands}
        self._logs = logs
        self._started = 0
        self.running: dict[str, NodeProcess] = {}

    def __enter__(self) -> "NodePair":
        for name in self._commands:
            self.start(name)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.end()

    def start(self, name: str) -> None:
        """Start a node, in place of one of its name that was killed."""
        self._started += 1
        with uninterrupted():
            log = self._logs / f"{self._started}_{name}.log"
            self.running[name] = NodeProcess(self._commands[name], log)

    def kill(self, name: str) -> None:
        """End a node at once, as the system does when memory runs out."""
        process = self.running.pop(name)
        os.killpg(process.pid, signal.SIGKILL)
        process.stop()

    def check(self) -> None:
        """Raise NodeDiedError if a node has ended by itself."""
        for process in self.running.values():
            process.check()

    def end(self) -> dict[str, tuple[int, str]]:
        """Ask the nodes to end; return the exit code and output of each."""
        with uninterrupted():
            for process in self.running.values():
                process.interrupt()
            ended = {
                name: (process.stop(), process.output()) for name, process in self.running.items()
            }
        self.running = {}
        return ended
