# SPDX-License-Identifier: Apache-2.0
"""Stamps: what a step was made from, written when it is complete."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any


def read_stamp(path: Path) -> dict[str, Any]:
    """Return a stamp's content, empty where there is none that can be read."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def write_text(path: Path, text: str) -> None:
    """Write a file whole or not at all; leave it alone where nothing changed."""
    try:
        if path.read_text(encoding="utf-8") == text:
            return
    except OSError:
        pass
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(f"{path.name}.{os.getpid()}.new")
    fresh.write_text(text, encoding="utf-8")
    fresh.replace(path)


def write_stamp(path: Path, content: dict[str, Any]) -> None:
    """Write a stamp whole or not at all."""
    write_text(path, json.dumps(content, indent=1, sort_keys=True) + "\n")


def digest(path: Path) -> str:
    """Return a hash of a file's content."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
