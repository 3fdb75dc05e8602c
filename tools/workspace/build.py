# SPDX-License-Identifier: Apache-2.0
"""Builds the packages with colcon when something changed that a built workspace does not link to.

With --symlink-install the installed Python modules, launch files and data are links into `src`, so
editing them needs no build; a new or removed file does, and so does a change of a message, a
manifest or a build file.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from workspace.activation import in_ros_environment
from workspace.prerequisites import check_build_tools
from workspace.python_environment import PythonEnvironment
from workspace.report import SetupError, run_logged, stage
from workspace.stamps import digest, read_stamp, write_stamp

BUILD_FILES = ("package.xml", "setup.py", "setup.cfg", "CMakeLists.txt")
BUILD_SUFFIXES = (".msg", ".srv", ".cmake", ".meta")
# Run by the environment's Python, so that it becomes the Python of the installed executables.
COLCON = "import sys; from colcon_core.command import main; sys.exit(main(command_name='colcon'))"


class Build:
    """The built workspace of a root directory."""

    def __init__(self, environment: PythonEnvironment) -> None:
        self.environment = environment
        self.root = environment.root
        self._stamp = self.root / "build" / "workspace.json"
        self._log = self.root / "log" / "setup" / "colcon.log"

    def sources(self) -> dict[str, str]:
        """Return the files that make a build necessary, with a hash where their content does."""
        found = {}
        for path in self._source_files():
            content_matters = path.name in BUILD_FILES or path.suffix in BUILD_SUFFIXES
            found[str(path.relative_to(self.root))] = digest(path) if content_matters else ""
        return found

    def is_current(self) -> bool:
        """Tell whether the build is complete and as it would be made now."""
        stamp = read_stamp(self._stamp)
        return (
            stamp.get("complete") is True
            and stamp.get("environment") == self.environment.identity()
            and stamp.get("sources") == self.sources()
            and all(self._is_installed(package) for package in self._packages())
        )

    def ensure(self, environ: Mapping[str, str]) -> None:
        """Build the packages.

        Raises:
            SetupError: they cannot be built.
        """
        check_build_tools(self.environment.ros, environ)
        stamp = {"environment": self.environment.identity(), "sources": self.sources()}
        with stage("Build of the ROS packages") as running:
            if not self._may_be_continued(stamp):
                for name in ("build", "install"):
                    if (self.root / name).exists():
                        shutil.rmtree(str(self.root / name))
            write_stamp(self._stamp, {**stamp, "running": True})
            command = in_ros_environment(self.root, self._colcon_command())
            # The user's own defaults may ask for another layout than the one relied upon here.
            colcon_environ = {**environ, "COLCON_DEFAULTS_FILE": os.devnull}
            returncode = run_logged(command, self._log, colcon_environ, running, self.root)
            write_stamp(self._stamp, {**stamp, "complete": returncode == 0})
            if returncode != 0:
                raise SetupError(f"colcon could not build the ROS packages; see {self._log}.")

    def _source_files(self) -> Iterator[Path]:
        yield self.root / "colcon.meta"
        yield from sorted((self.root / "cmake").glob("*.cmake"))
        for package in self._packages():
            for folder, folders, names in os.walk(str(package)):
                # Modules are found through a link to the package's directory of the same name.
                skipped = {"__pycache__", "benchmarks", "test", package.name}
                folders[:] = sorted(name for name in folders if name not in skipped)
                yield from (Path(folder) / name for name in sorted(names) if name[0] != ".")

    def _packages(self) -> list[Path]:
        return sorted(path.parent for path in (self.root / "src").glob("*/package.xml"))

    def _is_installed(self, package: Path) -> bool:
        manifest = self.root / "install" / package.name / "share" / package.name / "package.xml"
        return manifest.is_file()

    def _may_be_continued(self, now: dict[str, Any]) -> bool:
        """Tell whether colcon can go on from the last build.

        It cannot where that was cut short, was made elsewhere or by hand, or holds removed files.
        """
        before = read_stamp(self._stamp)
        return (
            "running" not in before
            and before.get("environment") == now["environment"]
            and set(before.get("sources", {})) <= set(now["sources"])
        )

    def _colcon_command(self) -> list[str]:
        python = str(self.environment.python)
        return [
            *(python, "-c", COLCON, "--log-base", "log", "build", "--symlink-install"),
            *("--base-paths", "src", "--build-base", "build", "--install-base", "install"),
            *("--cmake-args", f"-DPython3_EXECUTABLE={python}"),
        ]
