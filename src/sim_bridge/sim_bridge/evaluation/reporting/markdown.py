# SPDX-License-Identifier: Apache-2.0
"""Pieces of Markdown: tables, and numbers with their intervals."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from sim_bridge.evaluation.reporting.selection import Line, Spread, reader, spread

NOTHING = "–"
OUTCOMES = ("success", "collision", "timeout")


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; the first column holds names, the others numbers."""
    rule = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join(f"| {' | '.join(line)} |" for line in (header, rule, *rows)) + "\n"


def text_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of sentences."""
    lines = (header, ["---"] * len(header), *rows)
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def versions_table(versions: Mapping[str, Any]) -> str:
    """Return the chapter that says what the results of a page were made with."""
    shown = ("git_revision", "python", "numpy", "numba", "map", "first_seed")
    rows = [[name, str(versions[name])] for name in shown if name in versions]
    parts = [f"## Made with\n\n{table(['what', 'version'], rows)}", entries_told(versions)]
    return "\n".join(part for part in parts if part)


def entries_told(versions: Mapping[str, Any]) -> str:
    """Return where vehicles enter in sight of the ego, and what that means; empty for nowhere."""
    sentences = []
    for map_name, lanes in versions.get("entries_in_sight_m", {}).items():
        where = ", ".join(f"{lane} ({way_m:g} m before its zone)" for lane, way_m in lanes.items())
        sentences.append(
            f"On {map_name} the map begins within the sensor's range on lanes {where}. Nobody "
            "enters there while the ego sees that place, so that traffic is thinner than the "
            "scenarios say for an ego that stands where it sees far.\n"
        )
    return "\n".join(sentences)


def folded(title: str, text: str) -> str:
    """Return text that a reader opens by its title."""
    return f"<details><summary>{title}</summary>\n\n{text}\n</details>\n"


def percent(value: Spread | None) -> str:
    """Return a share in percent with its interval."""
    if value is None:
        return NOTHING
    return f"{100 * value.value:.1f} [{100 * value.low:.1f}, {100 * value.high:.1f}]"


def number(value: Spread | None) -> str:
    """Return a number with its interval."""
    if value is None:
        return NOTHING
    return f"{value.value:.2f} [{value.low:.2f}, {value.high:.2f}]"


def bare(value: Spread | None, form: Callable[[float], str]) -> str:
    """Return a value without its interval."""
    return NOTHING if value is None else form(value.value)


def as_percent(value: float) -> str:
    """Return a share as percent with its sign."""
    return f"{100 * value:.1f}%"


def as_speed(value: float) -> str:
    """Return a speed with its unit."""
    return f"{value:.2f} m/s"


def result(lines: Sequence[Line]) -> str:
    """Return success / collision / timeout of one cell in percent, never one without the others."""
    if not lines:
        return NOTHING
    spreads = (spread(lines, reader(key)) for key in OUTCOMES)
    return " / ".join(bare(value, lambda share: f"{100 * share:.1f}") for value in spreads)
