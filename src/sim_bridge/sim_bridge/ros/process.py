# SPDX-License-Identifier: Apache-2.0
"""Starts the real node executables as processes of their own, and takes them down again."""

import json
import os
import signal
import socket
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix

from risk_dqn_planner.errors import ConfigurationError, PlannerError

ParameterValue = bool | int | float | str | Sequence[int]

_DOMAINS = 100  # ports of higher domains may be given to any program by the system


class NodeDiedError(PlannerError):
    """A node ended although nobody asked it to."""


def _is_free(domain_id: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # Where the first participant of the domain listens (DDS-RTPS 9.6.1.1).
            probe.bind(("", 7400 + 250 * domain_id + 10))
        except OSError:
            return False
    return True


@contextmanager
def own_domain() -> Iterator[int]:
    """Hold a ROS domain that nobody on this computer uses; processes start looking apart.

    Raises:
        ConfigurationError: every domain is in use.
    """
    for offset in range(_DOMAINS):
        domain_id = 1 + (os.getpid() + offset) % _DOMAINS
        # Two that look at the same time both find it free, but only one can take the name.
        with socket.socket(socket.AF_UNIX) as claim:
            try:
                claim.bind(f"\0risk_dqn_planner/ros_domain/{domain_id}")
            except OSError:
                continue
            if _is_free(domain_id):
                yield domain_id
                return
    raise ConfigurationError(f"none of the ROS domains 1 to {_DOMAINS} is free on this computer")


def isolate(domain_id: int) -> None:
    """Keep this process and its children to one domain on this computer; before rclpy.init."""
    os.environ["ROS_DOMAIN_ID"] = str(domain_id)
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"


@dataclass(frozen=True)
class NodeCommand:
    """What to run: an installed executable, its parameters and remappings."""

    package: str
    executable: str
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)
    remappings: Mapping[str, str] = field(default_factory=dict)

    def arguments(self) -> list[str]:
        """Command line; the file is the one that `ros2 run` executes.

        Raises:
            ConfigurationError: the executable is not installed.
        """
        try:
            prefix = Path(get_package_prefix(self.package))
        except PackageNotFoundError as error:
            raise ConfigurationError(
                f"package {self.package} is not installed, build the workspace and source it"
            ) from error
        executable = prefix / "lib" / self.package / self.executable
        if not executable.is_file():
            raise ConfigurationError(f"{executable} does not exist, build the workspace")
        command = [str(executable), "--ros-args"]
        for name, value in self.parameters.items():
            # JSON is YAML, which is what the parameter parser reads.
            command += ["-p", f"{name}:={json.dumps(value)}"]
        for private, plain in self.remappings.items():
            command += ["-r", f"{private}:={plain}"]
        return command


class NodeProcess:
    """A running node; what it prints goes to a file."""

    def __init__(self, command: NodeCommand, log: Path) -> None:
        self.name = command.executable
        self._log = log
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("wb") as output:
            # A group of its own: a Ctrl-C reaches the node through `stop`, in order.
            self._process = subprocess.Popen(  # noqa: S603 (the executable is ours)
                command.arguments(),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """Exit code, None while the node runs."""
        return self._process.poll()

    def output(self) -> str:
        """Everything the node has printed so far."""
        return self._log.read_text("utf-8", errors="replace")

    def check(self) -> None:
        """Raise NodeDiedError with the node's last line if it has ended."""
        if self.exit_code is not None:
            lines = self.output().strip().splitlines() or ["without a word"]
            raise NodeDiedError(f"{self.name} ended with code {self.exit_code}: {lines[-1]}")

    def interrupt(self) -> None:
        """Ask the node to end, as Ctrl-C does."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGINT)

    def stop(self, patience_s: float = 5.0) -> int:
        """Wait for the node to end, ask ever less politely, and return its exit code."""
        for request in (signal.SIGTERM, signal.SIGKILL):
            if not self._ends_within(patience_s):
                os.killpg(self._process.pid, request)
        return self._process.wait()

    def _ends_within(self, timeout_s: float) -> bool:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout_s)
        return self._process.poll() is not None
