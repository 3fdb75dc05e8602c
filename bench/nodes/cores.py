# SPDX-License-Identifier: Apache-2.0
"""Who runs on which core, and cores that are kept busy."""

import os
import subprocess
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager


def all_cores() -> frozenset[int]:
    """Return every core that the system lets this process use, were it bound or not."""
    bound = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    found = os.sched_getaffinity(0)
    os.sched_setaffinity(0, bound)
    return frozenset(found)


@contextmanager
def bound_to(cores: Collection[int]) -> Iterator[None]:
    """Bind this thread, and whatever it starts within, to some cores."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cores)
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@contextmanager
def busy_loops(cores: Collection[int]) -> Iterator[None]:
    """Keep each of these cores busy with a process of ordinary priority that never waits."""
    loops: list[subprocess.Popen[bytes]] = []
    try:
        for core in sorted(cores):
            with bound_to({core}):
                loops.append(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
        yield
    finally:
        for loop in loops:
            loop.kill()
        for loop in loops:
            loop.wait()
