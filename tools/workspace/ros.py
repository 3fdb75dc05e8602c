# SPDX-License-Identifier: Apache-2.0
"""Which ROS 2 the workspace stands on: an installed Jazzy, or the wheels."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from workspace.report import SetupError

DISTRO = "jazzy"
APT_PREFIX = Path("/opt/ros") / DISTRO


@dataclass(frozen=True)
class RosSource:
    """Where ROS comes from.

    `prefix` is the directory with rclpy of an installed ROS, None for the wheels; `setup_script` is
    to be sourced where that ROS is not in the environment yet.
    """

    prefix: Path | None
    setup_script: Path | None = None

    @property
    def is_installed(self) -> bool:
        """Tell an installed ROS from the wheels."""
        return self.prefix is not None

    @property
    def title(self) -> str:
        """Return how it is called in messages."""
        return f"ROS 2 Jazzy at {self.prefix}" if self.prefix else "ROS 2 Jazzy from wheels"


def find_ros(environ: Mapping[str, str], root: Path, apt_prefix: Path = APT_PREFIX) -> RosSource:
    """Choose the sourced Jazzy, else the one installed by apt, else the wheels.

    What this workspace itself put into the environment (`make shell`) does not count as sourced,
    and ROS_FROM=wheels passes over any ROS that is there.

    Raises:
        SetupError: another ROS is sourced.
    """
    if environ.get("ROS_FROM", "") not in ("", "wheels"):
        raise SetupError(f"ROS_FROM={environ['ROS_FROM']} is unknown; it may be 'wheels' or unset.")
    if environ.get("ROS_FROM"):
        return RosSource(None)
    distro = environ.get("ROS_DISTRO", "")
    if distro not in ("", DISTRO):
        raise SetupError(
            f"ROS '{distro}' is sourced in this shell, but this project needs ROS 2 Jazzy: use a "
            f"shell that sources {apt_prefix}/setup.bash or none, or pass ROS_FROM=wheels."
        )
    setup_script = apt_prefix / "setup.bash"
    for entry in environ.get("AMENT_PREFIX_PATH", "").split(":"):
        prefix = Path(entry)
        if not entry or root in (prefix, *prefix.parents):
            continue
        if (prefix / "share" / "rclpy" / "package.xml").is_file():
            return RosSource(prefix, setup_script if prefix == apt_prefix else None)
    if setup_script.is_file():
        return RosSource(apt_prefix, setup_script)
    return RosSource(None)


def ros_environment(ros: RosSource, environ: Mapping[str, str]) -> dict[str, str]:
    """Return the variables under which this ROS and its Python are to be used.

    Traces of other Python environments are left behind: with the wheels, PYTHONPATH would mix
    them with whatever it names, and their start-up guard would keep their libraries from loading.

    Raises:
        SetupError: the setup script of an installed ROS fails.
    """
    foreign = {"PYTHONHOME", "VIRTUAL_ENV", "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    if not ros.is_installed:
        foreign.add("PYTHONPATH")
    clean = {name: value for name, value in environ.items() if name not in foreign}
    sourced = str(ros.prefix) in environ.get("AMENT_PREFIX_PATH", "").split(":")
    if not ros.is_installed or sourced:
        return clean
    answer = subprocess.run(  # noqa: S603 - the setup script of ROS
        ["/bin/bash", "-c", '. "$0" >&2 && exec env -0', str(ros.setup_script)],
        env=clean,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if answer.returncode != 0:
        raise SetupError(f"{ros.setup_script} fails; repair or remove this ROS installation.")
    pairs = (entry.partition("=") for entry in answer.stdout.split("\0") if entry)
    return {name: value for name, _, value in pairs}
