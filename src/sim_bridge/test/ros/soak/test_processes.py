# SPDX-License-Identifier: Apache-2.0
import os
import threading
import time
from pathlib import Path

import pytest

from sim_bridge.ros.soak.processes import computed_s, usage


def test_memory_that_is_written_to_counts() -> None:
    before = usage(os.getpid()).resident_bytes
    held = bytearray(b"x" * 40_000_000)
    assert 39e6 < usage(os.getpid()).resident_bytes - before < 60e6
    assert held


def test_an_open_file_and_a_thread_count_until_they_are_gone(tmp_path: Path) -> None:
    before, done = usage(os.getpid()), threading.Event()
    thread = threading.Thread(target=done.wait)
    with (tmp_path / "file").open("w"):
        thread.start()
        within = usage(os.getpid())
    done.set()
    thread.join()
    after = usage(os.getpid())
    assert (within.files, within.threads) == (before.files + 1, before.threads + 1)
    assert (after.files, after.threads) == (before.files, before.threads)


def test_computing_counts_and_sleeping_does_not() -> None:
    begin_s = computed_s(os.getpid())
    until = time.process_time() + 0.3
    while time.process_time() < until:
        pass
    worked_s = computed_s(os.getpid())
    time.sleep(0.3)
    assert worked_s - begin_s == pytest.approx(0.3, abs=0.1)
    assert computed_s(os.getpid()) - worked_s < 0.1


def test_a_process_that_does_not_exist_is_an_error() -> None:
    with pytest.raises(OSError, match=r"/proc/\d+/status"):
        usage(2**30)
