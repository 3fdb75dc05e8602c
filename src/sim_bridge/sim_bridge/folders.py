# SPDX-License-Identifier: Apache-2.0
"""Folders that users name for results."""

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
