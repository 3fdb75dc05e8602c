# SPDX-License-Identifier: Apache-2.0
"""However the demo ends, it leaves no process behind and says why in one sentence."""

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from commands import executable, run

from sim_bridge.ros.session import wait_until

pytestmark = pytest.mark.ros

PATIENCE_S = 300.0
MARK = "DEMO_STARTED_BY_TEST"


class RunningDemo:
    """A demo in real time whose processes, however distant, can be told by their environment."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.process = subprocess.Popen(
            [executable("demo"), "--rate", "1.0", "--out", str(folder)],
            env=os.environ | {MARK: str(folder)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def processes(self) -> list[Path]:
        """Folders in /proc of the demo and its nodes."""
        return [folder for folder in Path("/proc").glob("[0-9]*") if self._owns(folder)]

    def _owns(self, process: Path) -> bool:
        try:
            return f"{MARK}={self._folder}".encode() in (process / "environ").read_bytes()
        except OSError:  # it has just ended, or is not ours
            return False

    def starts(self) -> bool:
        """Whether the last node has just been started."""
        return len(self.processes()) >= 4

    def drives(self) -> bool:
        """Whether the policy takes decisions."""
        log = self._folder / "log" / "policy_node.log"
        return log.is_file() and "deciding" in log.read_text("utf-8")

    def wait(self, holds: Callable[[], bool]) -> None:
        wait_until(holds, "the demo", PATIENCE_S, lambda: None)
        assert self.process.poll() is None

    def node(self, name: str) -> int:
        """Process id of a node."""
        found = [p for p in self.processes() if name.encode() in (p / "cmdline").read_bytes()]
        return int(found[0].name)

    def end(self) -> str:
        """Wait for the end and return what went to the standard error."""
        return self.process.communicate(timeout=PATIENCE_S)[1]


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[RunningDemo]:
    running = RunningDemo(tmp_path)
    yield running
    running.process.terminate()
    running.process.wait(PATIENCE_S)


@pytest.mark.parametrize("request_to_end", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
@pytest.mark.parametrize(
    "moment", [RunningDemo.starts, RunningDemo.drives], ids=lambda m: m.__name__
)
def test_an_interrupted_demo_leaves_no_process_behind(
    demo: RunningDemo, moment: Callable[[RunningDemo], bool], request_to_end: signal.Signals
) -> None:
    demo.wait(lambda: moment(demo))
    demo.process.send_signal(request_to_end)
    errors = demo.end()
    assert demo.process.returncode == 130
    assert "Traceback" not in errors
    assert demo.processes() == []


def test_a_node_that_dies_ends_the_demo_which_names_it(demo: RunningDemo) -> None:
    demo.wait(demo.drives)
    os.kill(demo.node("policy_node"), signal.SIGKILL)
    errors = demo.end()
    assert demo.process.returncode == 1
    assert "policy_node ended with code -9" in errors
    assert demo.processes() == []


def test_a_map_that_cannot_be_used_ends_the_demo_with_one_sentence() -> None:
    done = run("demo", "--map", "nowhere.osm", "--route", "1,2", "--origin", "49.0,8.4")
    assert done.returncode == 2
    assert done.stderr.startswith("demo: nowhere.osm does not exist")
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
