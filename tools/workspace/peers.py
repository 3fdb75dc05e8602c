# SPDX-License-Identifier: Apache-2.0
"""Makes `.venv-peers`: other people's simulators and learners, to measure this project beside them.

It sees the packages of the environment whose Python runs this, so that only what is missing there
is installed.
"""

from __future__ import annotations

import argparse
import os
import shutil
import site
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from workspace.main import ROOT, alone
from workspace.python_environment import pip_failure
from workspace.report import SetupError, run_logged, say, stage
from workspace.stamps import digest, read_stamp, write_stamp, write_text

MISSING = "PEERS_MISSING"
# Read when Python starts; unlike a plain line with the path, it reads the .pth files there too.
SEE_ALSO = "import site; site.addsitedir({path!r})\n"


class PeersEnvironment:
    """The peers' environment of a workspace, beside the one that runs this."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.directory = root / ".venv-peers"
        self.python = self.directory / "bin" / "python"
        self._requirements = root / "requirements" / "peers.txt"
        self._stamp = self.directory / "workspace.json"

    def recipe(self) -> dict[str, Any]:
        """Return all that decides what the environment holds."""
        return {
            "directory": str(self.directory),
            "python": sys.version,
            "beside": site.getsitepackages(),
            "requirements": digest(self._requirements),
        }

    def is_current(self) -> bool:
        """Tell whether the environment is complete and as it would be made now."""
        complete = read_stamp(self._stamp) == self.recipe()
        return complete and os.access(str(self.python), os.X_OK)

    def ensure(self, environ: Mapping[str, str]) -> None:
        """Make the environment anew.

        Raises:
            SetupError: it cannot be made, for example without a network.
        """
        if self.directory.exists():
            shutil.rmtree(str(self.directory))
        with stage("Virtual environment .venv-peers") as running:
            # Its pip is the one of the environment that it sees.
            command = [sys.executable, "-m", "venv", "--without-pip", str(self.directory)]
            log = self.root / "log" / "setup" / "venv-peers.log"
            if run_logged(command, log, environ, running, self.root) != 0:
                raise SetupError(f"The peers' virtual environment cannot be made; see {log}.")
        folder = next(self.directory.glob("lib/python3.*/site-packages"))
        lines = [SEE_ALSO.format(path=path) for path in site.getsitepackages()]
        write_text(folder / "workspace.pth", "".join(lines))
        with stage("The peers' Python packages") as running:
            command = [str(self.python), "-m", "pip", "install", "--no-input", "--no-deps"]
            command += ["--disable-pip-version-check", "--progress-bar=off", "--no-compile"]
            command += ["-r", str(self._requirements)]
            log = self.root / "log" / "setup" / "pip-peers.log"
            pip_environ = {**environ, "PIP_USER": "0"}
            if run_logged(command, log, pip_environ, running, self.root) != 0:
                raise SetupError(pip_failure(log))
        write_stamp(self._stamp, self.recipe())


def _arguments(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="tools/peers.py", description="Make the peers' environment, then run a command in it."
    )
    parser.add_argument("command", nargs="*", metavar="-- COMMAND ...", help="run this afterwards")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str], root: Path = ROOT) -> int:
    """Run the command line; return the exit code, or become the command."""
    command = _arguments(arguments).command
    environment = PeersEnvironment(root)
    variables = {name: value for name, value in os.environ.items() if name != MISSING}
    try:
        with alone(root):
            if not environment.is_current():
                environment.ensure(variables)
        variables["PATH"] = f"{environment.python.parent}{os.pathsep}{variables.get('PATH', '')}"
    except (SetupError, OSError) as error:
        say(f"warning: {error} Going on without the peers.")
        variables[MISSING] = str(error)
    except KeyboardInterrupt:
        say("\nInterrupted; the next run takes it up again.")
        return 130
    if command:
        os.execvpe(command[0], command, variables)  # noqa: S606 - the user's command
    return 0 if MISSING not in variables else 1
