# SPDX-License-Identifier: Apache-2.0
"""A story as a table for the terminal."""

import math
from collections.abc import Iterator, Sequence
from datetime import datetime, timezone

from rich.table import Table

from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.story.chapters import Change, Chapter

_COLORS = {Action.STOP: "red", Action.SLOW: "yellow", Action.FAST: "green"}
# Simulated clocks count from zero; what is later than 2001 is taken for a date.
_DATES_FROM_NS = 1_000_000_000 * SECOND_NS


def clock(stamp_ns: int) -> str:
    """Return a time in words: a date in UTC, or seconds of a simulated clock."""
    if stamp_ns < _DATES_FROM_NS:
        return f"{stamp_ns / SECOND_NS:.2f} s"
    seconds, rest_ns = divmod(stamp_ns, SECOND_NS)
    time = datetime.fromtimestamp(seconds, tz=timezone.utc)
    return f"{time:%Y-%m-%d %H:%M:%S}.{rest_ns // 10_000_000:02d}Z"


def number(value: float) -> str:
    """Return a number with one decimal, a dash where it is not known."""
    return "-" if math.isnan(value) else f"{value:.1f}"


def reason(change: Change) -> str:
    """Return why, without the action that goes before."""
    return change.moment.text.removeprefix(f"{change.moment.action.name}: ")


def tables(story: Sequence[Chapter]) -> Iterator[str | Table]:
    """Yield each chapter as its heading, its changes and its end."""
    for chapter in story:
        if chapter.heading:
            yield f"[bold]{chapter.heading}[/bold]"
        yield _table(chapter)
        if chapter.ending:
            yield f"[bold]{chapter.ending}[/bold]"


def _table(chapter: Chapter) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    for name in ("after [s]", "clock", "for [s]", "line [m]", "[m/s]"):
        table.add_column(name.replace("[", r"\["), justify="right", no_wrap=True)
    table.add_column("action", no_wrap=True)
    table.add_column("why", overflow="fold")
    for change in chapter.changes:
        moment = change.moment
        if change.silence_s > 0.0:
            words = f"no decision for {change.silence_s:.1f} s"
            table.add_row(*[""] * 6, f"[bold magenta]{words}[/bold magenta]")
        color = _COLORS[moment.action]
        table.add_row(
            f"{chapter.seconds(moment):.1f}",
            clock(moment.stamp_ns),
            f"{change.lasted_s:.1f}",
            number(moment.stop_line_distance_m),
            number(moment.ego_speed_mps),
            f"[{color}]{moment.action.name}[/{color}]",
            reason(change).replace("[", r"\["),
        )
    return table
