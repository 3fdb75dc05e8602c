# SPDX-License-Identifier: Apache-2.0
"""Folders and pages that users name for results."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from risk_dqn_planner.errors import ConfigurationError


@contextmanager
def writing_to(folder: Path) -> Iterator[None]:
    """Make a folder, and say in a sentence what hinders writing there: a file, rights, no room.

    Raises:
        ConfigurationError: the folder cannot be made, or nothing more can be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise ConfigurationError(f"cannot write to {error.filename or folder}: {reason}") from error


def require_writable(page: Path | None) -> None:
    """Make a page's folder and see that it can be written there, before hours of work; None: none.

    Raises:
        ConfigurationError: it is a folder itself, or rights are missing.
    """
    if page is None:
        return
    with writing_to(page.parent):
        if page.is_dir():
            raise ConfigurationError(f"cannot write to {page}: it is a folder, expected a file")
        place = page if page.exists() else page.parent
        if not os.access(place, os.W_OK):
            raise ConfigurationError(f"cannot write to {place}: Permission denied")
