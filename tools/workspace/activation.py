# SPDX-License-Identifier: Apache-2.0
"""Writes the shell scripts that put a command into the workspace's environment."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from workspace.python_environment import PythonEnvironment
from workspace.stamps import write_text

ROS_SCRIPT = "ros_environment.sh"
WORKSPACE_SCRIPT = "activate_workspace.sh"
HEADER = "# Written by tools/bootstrap.py, to be sourced by bash.\n"
FAST_DDS_PROFILE = Path("tools") / "fastdds_quick_discovery.xml"

WHEELS = """\
unset PYTHONHOME PYTHONPATH COLCON_PREFIX_PATH
export ROS_DISTRO=jazzy ROS_VERSION=2 ROS_PYTHON_VERSION=3 RMW_IMPLEMENTATION=rmw_fastrtps_cpp
export AMENT_PREFIX_PATH="$VIRTUAL_ENV" CMAKE_PREFIX_PATH="$VIRTUAL_ENV"
# Left alone, every Python started here would set this path by starting itself a second time; the
# guard says that it is set.
export LD_LIBRARY_PATH={libraries}"${{LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}}"
export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1
"""

INSTALLED_ROS = """\
unset PYTHONHOME
case ":$AMENT_PREFIX_PATH:" in
  *:{prefix}:*) ;;
  *) . {setup_script} ;;
esac
"""

COMMON = """\
export WORKSPACE_ROOT={root}
export VIRTUAL_ENV={environment}
case "$PATH" in
  "$VIRTUAL_ENV/bin:"*) ;;
  *) export PATH="$VIRTUAL_ENV/bin:$PATH" ;;
esac
# Unless the user decided otherwise, nodes talk on this machine only and find each other quickly.
export ROS_AUTOMATIC_DISCOVERY_RANGE="${{ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}}"
export FASTRTPS_DEFAULT_PROFILES_FILE="${{FASTRTPS_DEFAULT_PROFILES_FILE:-{profile}}}"
"""

OVERLAY = """\
. {ros_script}
if [ -f {setup} ]; then
  . {setup}
fi
"""


def write_activation(environment: PythonEnvironment) -> None:
    """Write the scripts of ROS alone, for the build, and of the built workspace."""
    root, directory = environment.root, environment.directory
    quoted = shlex.quote
    text = HEADER + COMMON.format(
        root=quoted(str(root)),
        environment=quoted(str(directory)),
        profile=str(root / FAST_DDS_PROFILE),
    )
    ros = environment.ros
    if ros.is_installed:
        text += INSTALLED_ROS.format(
            prefix=quoted(str(ros.prefix)),
            setup_script=quoted(str(ros.setup_script)) if ros.setup_script else "false",
        )
    else:
        packages = sorted(directory.glob("lib/python3.*/site-packages/ros_*.libs"))
        libraries = ":".join(str(path) for path in (directory / "lib", *packages))
        text += WHEELS.format(libraries=quoted(libraries))
    write_text(directory / ROS_SCRIPT, text)
    overlay = OVERLAY.format(
        ros_script=quoted(str(directory / ROS_SCRIPT)),
        setup=quoted(str(root / "install" / "local_setup.bash")),
    )
    write_text(directory / WORKSPACE_SCRIPT, HEADER + overlay)


def _in_environment(script: Path, command: Sequence[str]) -> list[str]:
    return ["bash", "-c", '. "$0" && exec "$@"', str(script), *command]


def in_ros_environment(root: Path, command: Sequence[str]) -> list[str]:
    """Wrap a command to run with ROS but without the built packages."""
    return _in_environment(root / ".venv" / ROS_SCRIPT, command)


def in_workspace(root: Path, command: Sequence[str]) -> list[str]:
    """Wrap a command to run with ROS and the built packages."""
    return _in_environment(root / ".venv" / WORKSPACE_SCRIPT, command)
