# SPDX-License-Identifier: Apache-2.0
"""A node's process ends when asked, whatever the node is in the middle of."""

import signal
import subprocess
import sys

import pytest

# Foreign code may die of an exception: torch does where its own C++ code calls Python.
LOADING_FOR_EVER = """
import os, time
from risk_dqn_planner.ros.lifecycle import ManagedNode
from risk_dqn_planner.ros.main import run_managed

class Loading(ManagedNode):
    def configure(self):
        print("loading", flush=True)
        try:
            while True:
                time.sleep(0.01)
        except BaseException:
            os.abort()

raise SystemExit(run_managed("loading", lambda: Loading("loading")))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_request_to_end_raises_nothing_in_what_is_loaded(number: signal.Signals) -> None:
    command = [sys.executable, "-c", LOADING_FOR_EVER]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:  # noqa: S603 (our own Python)
        assert process.stdout is not None
        assert process.stdout.readline() == "loading\n"
        process.send_signal(number)
        process.send_signal(number)
        assert process.wait(30.0) == 0
