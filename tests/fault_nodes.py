# SPDX-License-Identifier: Apache-2.0
"""Situation and policy node as processes that may be killed and started again."""

import os
import signal
from pathlib import Path

from sim_bridge.ros.node_group import NodeGroup, uninterrupted
from sim_bridge.ros.process import NodeProcess


class NodePair(NodeGroup):
    """The planner's two nodes; a context manager."""

    def start(self, name: str) -> None:
        """Start a node again that was killed; what the killed one printed is kept beside it."""
        command = next(command for command in self._commands if command.executable == name)
        with uninterrupted():
            self._processes.append(NodeProcess(command, self._free_log(name)))

    def kill(self, name: str) -> None:
        """End a node at once, as the system does when memory runs out."""
        process = next(process for process in self._processes if process.name == name)
        os.killpg(process.pid, signal.SIGKILL)
        process.stop()
        self._processes.remove(process)

    def end(self) -> dict[str, tuple[int, str]]:
        """Ask the nodes to end; return the exit code and output of each."""
        self.stop()
        return {process.name: (process.stop(), process.output()) for process in self._processes}

    def _free_log(self, name: str) -> Path:
        number = len(list(self._log_folder.glob(f"*{name}.log")))
        return self._log_folder / f"{number}_{name}.log"
