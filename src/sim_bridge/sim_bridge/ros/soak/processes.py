# SPDX-License-Identifier: Apache-2.0
"""What the system knows of a process: memory, threads, open files, time computed (Linux)."""

import os
from pathlib import Path
from typing import NamedTuple

_KIB = 1024


class Usage(NamedTuple):
    """What a process holds: memory that is present [bytes], threads, open files."""

    resident_bytes: int
    threads: int
    files: int


def usage(pid: int) -> Usage:
    """Return what a process holds at present.

    Raises:
        OSError: there is no such process, or it belongs to somebody else.
    """
    folder = Path(f"/proc/{pid}")
    lines = (folder / "status").read_text(encoding="utf-8").splitlines()
    values = dict(line.split(":", maxsplit=1) for line in lines)
    return Usage(
        resident_bytes=int(values["VmRSS"].split()[0]) * _KIB,
        threads=int(values["Threads"]),
        files=len(os.listdir(folder / "fd")),  # noqa: PTH208 (a folder of the kernel's)
    )


def computed_s(pid: int) -> float:
    """Return how long a process has computed, all its threads together [s].

    Raises:
        OSError: there is no such process.
    """
    text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    # The name, in brackets, may hold anything; the 14th and 15th field of the line count ticks.
    fields = text.rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
