# SPDX-License-Identifier: Apache-2.0
"""Makes the virtual environment `.venv`: ROS from wheels, or what an installed ROS lacks."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workspace.interpreters import Interpreter, find_interpreter, probe
from workspace.prerequisites import check_room
from workspace.report import SetupError, run_logged, stage
from workspace.ros import RosSource, ros_environment
from workspace.stamps import digest, read_stamp, write_stamp, write_text

DEVELOPMENT = "development.txt"
WHEEL_REQUIREMENTS = ("ros-jazzy.txt", "python.txt", DEVELOPMENT)
WHEEL_CONSTRAINTS = "constraints.txt"
INSTALLED_ROS_REQUIREMENTS = "system-ros.txt"

NO_ROOM = re.compile(r"No space left on device|Errno 28")
NO_NETWORK = re.compile(
    r"NewConnectionError|Failed to establish a new connection|name resolution|getaddrinfo|"
    r"Network is unreachable|Connection refused|Max retries exceeded|timed out|ProxyError|SSLError"
)


class PythonEnvironment:
    """The virtual environment of a workspace, and what it has to be made from."""

    def __init__(self, root: Path, ros: RosSource) -> None:
        self.root = root
        self.ros = ros
        self.directory = root / ".venv"
        self.python = self.directory / "bin" / "python"
        self._stamp = self.directory / "workspace.json"
        self._log = root / "log" / "setup" / "pip.log"

    def recipe(self) -> dict[str, Any]:
        """Return all that decides what the environment holds, apart from the Python."""
        names = (
            (INSTALLED_ROS_REQUIREMENTS, "python.txt")
            if self.ros.is_installed
            else (*WHEEL_REQUIREMENTS, WHEEL_CONSTRAINTS)
        )
        files = {name: digest(self.root / "requirements" / name) for name in names}
        return {
            "directory": str(self.directory),
            "ros": str(self.ros.prefix or "wheels"),
            "requirements": files,
        }

    def identity(self) -> dict[str, Any]:
        """Return what builds depend on: those made with another environment are void."""
        stamp = read_stamp(self._stamp)
        recipe = dict(stamp.get("recipe", {}))
        files = recipe.get("requirements", {})
        recipe["requirements"] = {name: files[name] for name in files if name != DEVELOPMENT}
        return {"recipe": recipe, "executable": stamp.get("executable")}

    def is_current(self, requested: str, environ: Mapping[str, str]) -> bool:
        """Tell whether the environment is complete and as it would be made now."""
        stamp = read_stamp(self._stamp)
        return (
            stamp.get("recipe") == self.recipe()
            and os.access(str(self.python), os.X_OK)
            and self._has_python(stamp, requested, environ)
        )

    def ensure(self, requested: str, environ: Mapping[str, str]) -> None:
        """Make the environment, or mend it where something changed.

        Raises:
            SetupError: it cannot be made.
        """
        ros_environ = ros_environment(self.ros, environ)
        interpreter = find_interpreter(requested, self.ros, ros_environ)
        kept = self._may_be_updated(interpreter)
        if not kept:
            check_room(self.root)
        if self._stamp.exists():
            self._stamp.unlink()
        if not kept:
            self._create(interpreter, ros_environ)
        self._install(interpreter, ros_environ)
        write_stamp(
            self._stamp,
            {
                "recipe": self.recipe(),
                "executable": str(interpreter.executable),
                "requested": requested,
            },
        )

    def _has_python(
        self, stamp: Mapping[str, Any], requested: str, environ: Mapping[str, str]
    ) -> bool:
        if not requested or requested == stamp.get("requested"):
            return True
        executable = shutil.which(requested, path=environ.get("PATH"))
        candidate = probe(executable, environ) if executable else None
        return candidate is not None and str(candidate.executable) == stamp.get("executable")

    def _may_be_updated(self, interpreter: Interpreter) -> bool:
        """Tell whether only requirements changed since the environment was completed."""
        stamp = read_stamp(self._stamp)
        before = {**stamp.get("recipe", {}), "requirements": None}
        return (
            before == {**self.recipe(), "requirements": None}
            and stamp.get("executable") == str(interpreter.executable)
            and os.access(str(self.python), os.X_OK)
        )

    def _create(self, interpreter: Interpreter, environ: Mapping[str, str]) -> None:
        """Make an empty environment; what was there may be half an installation, so it goes."""
        if self.directory.exists():
            shutil.rmtree(str(self.directory))
        command = [str(interpreter.executable), "-m", "venv", str(self.directory)]
        if self.ros.is_installed:
            command.append("--system-site-packages")
        log = self._log.with_name("venv.log")
        with stage(f"Virtual environment .venv ({interpreter.title})") as running:
            if run_logged(command, log, environ, running, self.root) != 0:
                raise SetupError(
                    f"{interpreter.executable} cannot make a virtual environment; see {log}, or "
                    "pass another Python as PYTHON=/path/to/python."
                )

    def _install(self, interpreter: Interpreter, environ: Mapping[str, str]) -> None:
        command = [str(self.python), "-m", "pip", "install", *self._pip_arguments(interpreter)]
        pip_environ = {**environ, "PIP_USER": "0"}
        with stage(f"Python packages ({self.ros.title})") as running:
            if run_logged(command, self._log, pip_environ, running, self.root) != 0:
                raise SetupError(pip_failure(self._log))

    def _pip_arguments(self, interpreter: Interpreter) -> list[str]:
        requirements = self.root / "requirements"
        # pip's own configuration and environment variables decide where packages come from. Python
        # compiles what it imports; compiling all of it here would take half of the set-up.
        arguments = ["--no-input", "--disable-pip-version-check", "--progress-bar=off"]
        arguments.append("--no-compile")
        if not self.ros.is_installed:
            for name in WHEEL_REQUIREMENTS:
                arguments += ["-r", str(requirements / name)]
            return [*arguments, "-c", str(requirements / WHEEL_CONSTRAINTS)]
        arguments += ["-r", str(requirements / INSTALLED_ROS_REQUIREMENTS)]
        if interpreter.numpy:
            constraints = self.directory / "constraints.txt"
            write_text(constraints, f"numpy=={interpreter.numpy}\n")
            arguments += ["-c", str(constraints)]
        if not interpreter.lanelet2:
            lines = (requirements / "python.txt").read_text(encoding="utf-8").splitlines()
            arguments += [line for line in lines if line.startswith("lanelet2")]
        return arguments


def pip_failure(log: Path) -> str:
    """Say in a sentence why pip failed, from what it printed."""
    text = log.read_text(encoding="utf-8", errors="replace")
    if NO_ROOM.search(text):
        return (
            "The disk became full while packages were installed: make room (also where TMPDIR "
            f"points) and run this again; see {log}."
        )
    if NO_NETWORK.search(text):
        return (
            "pip could not reach its package index: connect to the network, or configure pip's "
            f"index or proxy, and run this again; see {log}."
        )
    errors = [line for line in text.splitlines() if line.startswith("ERROR:")]
    reason = errors[-1][len("ERROR:") :].strip() if errors else "it names no reason"
    return f"pip could not install the packages ({reason}); see {log}."
