# SPDX-License-Identifier: Apache-2.0
"""What the user sees of a set-up: a line a stage with its seconds, a sentence on a failure."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

STATUS_WIDTH = 100


class SetupError(Exception):
    """The set-up cannot go on; the message is one sentence that says what to do."""


class Stage:
    """A running stage: its clock, and what it is busy with."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.detail = ""
        self._start = time.monotonic()
        self._finished = threading.Event()

    @property
    def seconds(self) -> float:
        """Return the time since the stage began."""
        return time.monotonic() - self._start

    def draw_until_finished(self) -> None:
        """Redraw the stage's line on a terminal once a second."""
        while not self._finished.wait(1.0):
            line = f"{self.title} ... {self.seconds:.0f} s  {self.detail}"
            _write(f"\r\033[K{line[:STATUS_WIDTH]}")

    def finish(self) -> None:
        """Stop drawing."""
        self._finished.set()


def _write(text: str) -> None:
    sys.stderr.write(text)
    sys.stderr.flush()


def say(sentence: str) -> None:
    """Tell the user something that is not a failure."""
    _write(f"{sentence}\n")


@contextlib.contextmanager
def stage(title: str) -> Iterator[Stage]:
    """Announce a stage, show its progress on a terminal, and say how long it took."""
    running = Stage(title)
    on_terminal = sys.stderr.isatty()
    _write(f"{title} ..." if on_terminal else f"{title} ...\n")
    painter = threading.Thread(target=running.draw_until_finished, daemon=True)
    if on_terminal:
        painter.start()
    outcome = "failed after"
    try:
        yield running
        outcome = "done in"
    finally:
        running.finish()
        if on_terminal:
            painter.join()
            _write("\r\033[K")
        _write(f"{title}: {outcome} {running.seconds:.1f} s\n")


def run_logged(
    command: Sequence[str], log: Path, environ: Mapping[str, str], running: Stage, cwd: Path
) -> int:
    """Run a command with its output in a log file and its last line beside the stage's clock."""
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("w", encoding="utf-8", errors="replace") as record:
        process = subprocess.Popen(  # noqa: S603 - built by this program
            list(command),
            cwd=str(cwd),
            env=dict(environ),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
        )
        try:
            for line in process.stdout or ():
                record.write(line)
                running.detail = line.strip() or running.detail
            return process.wait()
        except BaseException:
            # Interrupted: nothing may go on writing into what the next run repairs.
            process.terminate()
            process.wait()
            raise
