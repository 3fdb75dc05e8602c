# SPDX-License-Identifier: Apache-2.0
"""Finds a Python that can carry the workspace, and says what is wrong with those that cannot."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from workspace.report import SetupError
from workspace.ros import RosSource

SUPPORTED_VERSIONS = ((3, 10), (3, 11), (3, 12))
NAMES = ("python3", "python3.12", "python3.11", "python3.10")

# Prints what is asked of a candidate. A name on the PATH proves nothing: version managers leave
# stand-ins that fail, and distributions split venv and the C headers off.
PROBE = """
import importlib.util as u, json, os, platform, sys, sysconfig
print(json.dumps({
    "executable": sys.executable,
    "version": sys.version_info[:2],
    "implementation": platform.python_implementation(),
    "venv": all(u.find_spec(name) is not None for name in ("venv", "ensurepip")),
    "headers": os.path.isfile(os.path.join(sysconfig.get_path("include"), "Python.h")),
    "rclpy": u.find_spec("rclpy") is not None,
    "lanelet2": u.find_spec("lanelet2") is not None,
    "numpy": getattr(__import__("numpy"), "__version__") if u.find_spec("numpy") else "",
}))
"""


@dataclass(frozen=True)
class Interpreter:
    """A Python that was asked what it offers."""

    executable: Path
    version: tuple[int, int]
    implementation: str
    venv: bool
    headers: bool
    rclpy: bool
    lanelet2: bool
    numpy: str

    @property
    def title(self) -> str:
        """Return how it is called in messages."""
        return f"Python {self.version[0]}.{self.version[1]}"


def probe(executable: str, environ: Mapping[str, str]) -> Interpreter | None:
    """Ask a Python what it offers; None where it does not run."""
    try:
        answer = subprocess.run(  # noqa: S603 - a Python of the user's choice
            [executable, "-c", PROBE],
            env=dict(environ),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
            check=True,
        )
        found = json.loads(answer.stdout)
        found["executable"] = Path(found["executable"] or executable)
        found["version"] = (int(found["version"][0]), int(found["version"][1]))
        return Interpreter(**found)
    except (OSError, subprocess.SubprocessError, ValueError, TypeError, KeyError):
        return None


def _reason_against(candidate: Interpreter, ros: RosSource) -> str:
    """Say why a Python will not do and how to mend it, or nothing."""
    version = f"{candidate.version[0]}.{candidate.version[1]}"
    if candidate.implementation != "CPython":
        return f"{candidate.executable} is {candidate.implementation}, not CPython"
    if ros.is_installed and not candidate.rclpy:
        return f"{candidate.executable} cannot import rclpy of {ros.prefix}"
    if not ros.is_installed and candidate.version not in SUPPORTED_VERSIONS:
        return f"{candidate.executable} is Python {version}"
    if not candidate.venv:
        return (
            f"{candidate.executable} lacks the venv module (Debian and Ubuntu: sudo apt install "
            f"python{version}-venv)"
        )
    if not candidate.headers:
        return (
            f"{candidate.executable} lacks its C headers (Debian and Ubuntu: sudo apt install "
            f"python{version}-dev)"
        )
    return ""


def _wanted(ros: RosSource) -> str:
    if ros.is_installed:
        return "The Python that ROS 2 Jazzy was built for is needed"
    return "Python 3.10, 3.11 or 3.12 is needed, for which ROS 2 Jazzy exists as wheels"


def find_interpreter(requested: str, ros: RosSource, environ: Mapping[str, str]) -> Interpreter:
    """Return the requested Python, or the first on the PATH that can carry the workspace.

    Raises:
        SetupError: none can.
    """
    if requested:
        executable = shutil.which(requested, path=environ.get("PATH"))
        candidate = probe(executable, environ) if executable else None
        if candidate is None:
            raise SetupError(f"PYTHON={requested} does not run; pass the path of a working Python.")
        reason = _reason_against(candidate, ros)
        if reason:
            raise SetupError(f"{_wanted(ros)}, but with PYTHON={requested} {reason}.")
        return candidate

    reasons: list[str] = []
    for name in ("/usr/bin/python3", *NAMES) if ros.is_installed else NAMES:
        executable = shutil.which(name, path=environ.get("PATH"))
        candidate = probe(executable, environ) if executable else None
        if candidate is None:
            continue
        reason = _reason_against(candidate, ros)
        if not reason:
            return candidate
        if reason not in reasons:
            reasons.append(reason)
    found = "; ".join(reasons) if reasons else "no Python that runs is on the PATH"
    raise SetupError(f"{_wanted(ros)}, but {found}; or pass another one as PYTHON=/path/to/python.")
