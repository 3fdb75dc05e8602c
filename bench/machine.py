# SPDX-License-Identifier: Apache-2.0
"""One core for everything, and what has to be known of a machine to judge its numbers."""

import importlib.metadata
import os
import platform
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

PEERS = ("highway-env", "libsumo", "stable-baselines3")
LIBRARIES = ("numpy", "numba", "torch", "gymnasium", "shapely", "lanelet2")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def stay_on_one_core() -> int:
    """Bind this process to one core; return its number.

    To be called before numpy or torch are imported, which count cores as they load.
    """
    for name in THREADS:
        os.environ[name] = "1"
    core = max(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {core})
    return core


def version_of(package: str) -> str | None:
    """Return the version of an installed package, None where it is not installed."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def versions() -> dict[str, str | None]:
    """Return the version of everything that is measured."""
    from sim_bridge.learning.checkpoint import git_revision  # noqa: PLC0415 (imports numpy)

    found = {name: version_of(name) for name in (*LIBRARIES, *PEERS)}
    return {"python": platform.python_version(), "git_revision": git_revision(), **found}


def processor() -> str:
    """Return the processor's model."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def system() -> str:
    """Return the kernel's name, its version without what a distribution adds, and the machine."""
    about = platform.uname()
    return f"{about.system} {about.release.partition('-')[0]} {about.machine}"


def describe(core: int) -> dict[str, Any]:
    """Return the machine, and how busy it was with other work."""
    return {
        "processor": processor(),
        "cores": os.cpu_count(),
        "core_used": core,
        "load_average_at_start": os.getloadavg()[0],
        "system": system(),
        "begun": datetime.now(timezone.utc).isoformat(timespec="seconds"),
    }
