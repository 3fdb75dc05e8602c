# SPDX-License-Identifier: Apache-2.0
"""Finished cells on disk, so that an interrupted evaluation goes on where it was.

A result is found again only for exactly the same work: policy, scenario, map, episodes, and the
sources that compute it.
"""

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import risk_dqn_planner
import sim_bridge
from risk_dqn_planner.policies.fingerprint import fingerprint

# What only draws, prints or talks to ROS decides nothing.
_BESIDE_THE_POINT = ("ros", "reporting", "evaluate.py", "contestants.py", "__pycache__")


@cache
def sources_fingerprint() -> str:
    """Return a SHA-256 of the packages' sources, but for those that decide nothing."""
    digest = hashlib.sha256()
    for package in (risk_dqn_planner, sim_bridge):
        root = Path(str(package.__file__)).parent
        for path in sorted((*root.rglob("*.py"), *root.rglob("*.yaml"))):
            relative = path.relative_to(root)
            if not any(part in _BESIDE_THE_POINT for part in relative.parts):
                digest.update(str(relative).encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()


class Store:
    """Results by the fingerprint of the work that they took."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def get(self, work: Mapping[str, Any]) -> dict[str, Any] | None:
        """Return the result of some work, None if it has not been done, or its file is damaged."""
        try:
            result: dict[str, Any] = json.loads(self._path(work).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return result

    def put(self, work: Mapping[str, Any], result: Mapping[str, Any]) -> None:
        """Keep a result; a file is complete or absent."""
        self._folder.mkdir(parents=True, exist_ok=True)
        write_whole(self._path(work), json.dumps(dict(result), indent=1) + "\n")

    def _path(self, work: Mapping[str, Any]) -> Path:
        return self._folder / f"{fingerprint(work)[:32]}.json"


def write_whole(path: Path, text: str) -> None:
    """Write a file so that nobody ever sees half of it."""
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
