# SPDX-License-Identifier: Apache-2.0
"""What the machine must have before anything is installed."""

from __future__ import annotations

import os
import platform
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path

from workspace.report import SetupError
from workspace.ros import RosSource

OLDEST_GLIBC = (2, 28)
ROOM_GIB = 4.0


def _glibc_version() -> tuple[int, ...]:
    try:
        answer = os.confstr("CS_GNU_LIBC_VERSION") or ""
    except (OSError, ValueError):
        return ()
    return tuple(int(part) for part in answer.split()[-1].split(".")) if answer else ()


def check_machine(ros: RosSource) -> None:
    """Check that the ROS wheels run on this machine; an installed ROS has proved itself.

    Raises:
        SetupError: they do not.
    """
    if ros.is_installed:
        return
    how = "use the project in a container or machine with ROS 2 Jazzy installed."
    if not sys.platform.startswith("linux") or platform.machine() not in ("x86_64", "AMD64"):
        raise SetupError(
            f"ROS 2 Jazzy exists as wheels for x86-64 Linux only, and this is {platform.system()} "
            f"on {platform.machine()}: {how}"
        )
    glibc = _glibc_version()
    if glibc < OLDEST_GLIBC:
        found = "glibc {}.{}".format(*glibc[:2]) if glibc else "no glibc"
        raise SetupError(f"The ROS 2 Jazzy wheels need glibc 2.28 or newer, found {found}: {how}")


def check_build_tools(ros: RosSource, environ: Mapping[str, str]) -> None:
    """Check for what compiles the ROS messages.

    Raises:
        SetupError: something is missing.
    """
    tools = {
        "C compiler": ("CC", ("cc", "gcc", "clang")),
        "C++ compiler": ("CXX", ("c++", "g++", "clang++")),
        "make": ("MAKE", ("make", "gmake")),
    }
    if ros.is_installed:
        # The wheels come with a CMake of their own.
        tools["cmake"] = ("CMAKE_COMMAND", ("cmake",))
    path = environ.get("PATH")
    missing = []
    for title, (variable, names) in tools.items():
        chosen = environ.get(variable, "").split()[:1]
        if not any(shutil.which(name, path=path) for name in (*chosen, *names)):
            missing.append(title)
    if missing:
        raise SetupError(
            f"Not found: {', '.join(missing)}, which compile the ROS messages; install them "
            "(Debian and Ubuntu: sudo apt install build-essential cmake) and run this again."
        )


def check_location(root: Path) -> None:
    """Check that the tools below can work where the project lies.

    Raises:
        SetupError: they cannot.
    """
    if any(character.isspace() or character in ":;'\"$" for character in str(root)):
        raise SetupError(
            f"The path of this folder, {root}, has a space or a sign that colcon and pip do not "
            "bear: move it to another path and run this again."
        )


def check_room(root: Path) -> None:
    """Check that a new environment fits on the disk.

    Raises:
        SetupError: it does not.
    """
    free_gib = shutil.disk_usage(str(root)).free / 2**30
    if free_gib < ROOM_GIB:
        raise SetupError(
            f"Only {free_gib:.1f} GiB are free at {root}, and the set-up needs {ROOM_GIB:.0f} GiB: "
            "make room and run this again."
        )
