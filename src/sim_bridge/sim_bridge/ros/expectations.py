# SPDX-License-Identifier: Apache-2.0
"""The decisions expected of each bag as text, so that people see in a review what changes.

Beside a bag's messages lies decisions.txt with one line for each decision; CHANGES.md in the
folder of all bags says which of them were changed on purpose, and why.
"""

import datetime as dt
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from intersection_msgs.msg import Decision

from risk_dqn_planner.errors import BagError
from sim_bridge.ros.comparison import NOTHING_IN_TIME, described, time_of

DECISIONS = "decisions.txt"
CHANGES = "CHANGES.md"
_SHOWN = 8
_SEPARATOR = " s: "


def lines_of(decisions: Iterable[Decision]) -> dict[str, str]:
    """Return what is expected, by the time in seconds."""
    return {time_of(decision): described(decision) for decision in decisions}


def write_decisions(bag: Path, lines: Mapping[str, str]) -> None:
    """Write what is expected beside the bag's messages."""
    text = "".join(f"{time}{_SEPARATOR}{line}\n" for time, line in lines.items())
    (bag / DECISIONS).write_text(text, "utf-8")


def read_decisions(bag: Path) -> dict[str, str]:
    """Read what is expected; nothing if the bag is new.

    Raises:
        BagError: the file is damaged.
    """
    path = bag / DECISIONS
    if not path.is_file():
        return {}
    pairs = [line.split(_SEPARATOR, 1) for line in path.read_text("utf-8").splitlines()]
    if any(len(pair) != 2 for pair in pairs):
        raise BagError(f"{path} is damaged, expected lines such as '12.5 s: STOP, VEHICLE'")
    return dict(pairs)


def changes(before: Mapping[str, str], after: Mapping[str, str]) -> list[str]:
    """Return one line for each time at which the decision is another one, ordered by time."""
    times = sorted({*before, *after}, key=float)
    return [
        f"t = {time} s: {before.get(time, NOTHING_IN_TIME)} -> {after.get(time, NOTHING_IN_TIME)}"
        for time in times
        if before.get(time) != after.get(time)
    ]


def log_changes(folder: Path, changed: Mapping[str, Sequence[str]], reason: str) -> None:
    """Append to CHANGES.md which bags' decisions were changed on purpose, how and why."""
    path = folder / CHANGES
    head = "# Intended changes of decisions\n\nThe newest come last; `make bags` appends to them.\n"
    parts = [path.read_text("utf-8") if path.is_file() else head]
    parts.append(f"\n## {dt.datetime.now(dt.timezone.utc):%Y-%m-%d}: {reason}\n\n")
    for name, lines in changed.items():
        parts.append(f"- {name}: {len(lines)} decisions\n")
        parts += [f"  - {line}\n" for line in lines[:_SHOWN]]
        if len(lines) > _SHOWN:
            parts.append(f"  - and {len(lines) - _SHOWN} more\n")
    path.write_text("".join(parts), "utf-8")
