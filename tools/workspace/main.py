# SPDX-License-Identifier: Apache-2.0
"""The set-up from beginning to end, and its command line."""

from __future__ import annotations

import argparse
import contextlib
import errno
import fcntl
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from workspace.activation import in_workspace, write_activation
from workspace.build import Build
from workspace.prerequisites import check_build_tools, check_location, check_machine
from workspace.python_environment import PythonEnvironment
from workspace.report import SetupError, say
from workspace.ros import find_ros, ros_environment

ROOT = Path(__file__).resolve().parents[2]


@contextlib.contextmanager
def alone(root: Path) -> Iterator[None]:
    """Let one set-up at a time work on a workspace; a process that ends gives way by itself."""
    handle = os.open(str(root), os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            say("Waiting for another set-up of this workspace to end ...")
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def set_up(root: Path, with_build: bool) -> None:
    """Bring the environment, and the built packages if wanted, up to date.

    Raises:
        SetupError: the machine or the user has to do something first.
    """
    environ = dict(os.environ)
    requested = environ.get("PYTHON", "")
    check_location(root)
    ros = find_ros(environ, root)
    environment = PythonEnvironment(root, ros)
    with alone(root):
        if not environment.is_current(requested, environ):
            check_machine(ros)
            check_build_tools(ros, environ)
            environment.ensure(requested, environ)
        write_activation(environment)
        build = Build(environment)
        if with_build and not build.is_current():
            build.ensure(ros_environment(ros, environ))


def _arguments(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="tools/bootstrap.py",
        description="Set up the workspace where something changed, then run a command in it.",
    )
    parser.add_argument(
        "--no-build", action="store_true", help="leave the ROS packages as they are"
    )
    parser.add_argument("command", nargs="*", metavar="-- COMMAND ...", help="run this afterwards")
    return parser.parse_args(arguments)


def main(arguments: list[str]) -> int:
    """Run the command line; return the exit code, or become the command."""
    chosen = _arguments(arguments)
    for name in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL"):
        # Meant for the make that started this, not for those that compile.
        os.environ.pop(name, None)
    try:
        set_up(ROOT, with_build=not chosen.no_build)
        if chosen.command:
            command = in_workspace(ROOT, chosen.command)
            os.execvp(command[0], command)  # noqa: S606 - the user's command
    except SetupError as error:
        say(f"error: {error}")
        return 1
    except KeyboardInterrupt:
        say("\nInterrupted; the next run takes it up again.")
        return 130
    except OSError as error:
        advice = "make room" if error.errno == errno.ENOSPC else "check its permissions"
        say(f"error: {error.strerror}: {error.filename or ROOT}; {advice} and run this again.")
        return 1
    return 0
