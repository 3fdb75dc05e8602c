# SPDX-License-Identifier: Apache-2.0
"""Node processes that start and end together."""

import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType

from sim_bridge.ros.process import NodeCommand, NodeProcess


class NodeGroup:
    """Processes of nodes, all or none; a context manager."""

    def __init__(self, commands: Sequence[NodeCommand], log_folder: Path) -> None:
        self._commands = commands
        self._log_folder = log_folder
        self._processes: list[NodeProcess] = []

    def __enter__(self) -> "NodeGroup":
        try:
            with uninterrupted():
                for command in self._commands:
                    log = self._log_folder / f"{command.executable}.log"
                    self._processes.append(NodeProcess(command, log))
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def pids(self) -> dict[str, int]:
        """Process ids by the names of the executables."""
        return {process.name: process.pid for process in self._processes}

    def check(self) -> None:
        """Raise NodeDiedError if one of the nodes has ended."""
        for process in self._processes:
            process.check()

    def stop(self) -> None:
        """End all nodes: ask everyone first, then wait."""
        with uninterrupted():
            for process in self._processes:
                process.interrupt()
            for process in self._processes:
                process.stop()


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold requests to end back, or a process just started or not yet ended would be forgotten."""
    held: list[int] = []
    before = {
        request: signal.signal(request, lambda number, _: held.append(number))
        for request in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for request, handler in before.items():
            signal.signal(request, handler)
    if held:
        raise KeyboardInterrupt
