# SPDX-License-Identifier: Apache-2.0
"""The commands of the simulation, run as users run them."""

import subprocess
from pathlib import Path

from ament_index_python.packages import get_package_prefix

PATIENCE_S = 600.0  # for nodes that nobody has compiled yet, on a busy computer

Done = subprocess.CompletedProcess[str]


def executable(command: str) -> str:
    """The installed file of a command."""
    return str(Path(get_package_prefix("sim_bridge")) / "lib" / "sim_bridge" / command)


def run(command: str, *options: str) -> Done:
    """Run a command to its end, whatever that is."""
    return subprocess.run(
        [executable(command), *options],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
