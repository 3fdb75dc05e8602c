# SPDX-License-Identifier: Apache-2.0
"""A story as a picture: where the ego was and how fast, coloured by action, changes numbered."""

import math
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Action
from sim_bridge.rendering.top_view import ACTION_COLORS
from sim_bridge.ros.story.chapters import Change, Chapter
from sim_bridge.ros.story.reading import Moment
from sim_bridge.ros.story.table import reason

_WIDTH_IN, _PANELS_IN, _LINE_IN = 14.0, 5.0, 0.19
_BETWEEN_CHAPTERS_S = 2.0
_MOST_LINES, _LINE_LETTERS = 60, 190
_DPI = 120

Line = tuple[float, Moment]


def save_picture(story: Sequence[Chapter], title: str, path: Path) -> None:
    """Write the picture; the end of the name says in which format.

    Raises:
        ConfigurationError: that is no format of pictures, or the file cannot be written.
    """
    changes = list(_numbered(story))
    lines = _lines(changes)
    height_in = _PANELS_IN + _LINE_IN * (len(lines) + 2)
    figure = Figure(figsize=(_WIDTH_IN, height_in), layout="constrained")
    shares = [0.5 * _PANELS_IN, 0.5 * _PANELS_IN, _LINE_IN * (len(lines) + 1)]
    line, speed, words = figure.subplots(3, 1, height_ratios=shares)
    figure.suptitle(title)
    _draw(line, story, "stop_line_distance_m", "front to stop line [m]")
    _draw(speed, story, "ego_speed_mps", "speed [m/s]")
    speed.set_xlabel("time since the first decision [s]")
    for number, begin_s, _ in changes:
        line.annotate(
            str(number), (begin_s, 1.0), xycoords=("data", "axes fraction"), fontsize=7, va="bottom"
        )
    figure.legend(
        handles=[Patch(color=ACTION_COLORS[a], alpha=0.4, label=a.name) for a in Action],
        loc="outside upper right",
        ncols=len(Action),
    )
    words.axis("off")
    text = words.text(0.0, 1.0, "\n".join(lines), family="monospace", fontsize=7.5, va="top")
    text.set_in_layout(False)
    try:
        figure.savefig(path, dpi=_DPI)
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{path} cannot be written as a picture: {error}") from error


def _offsets(story: Sequence[Chapter]) -> Iterator[tuple[Chapter, float]]:
    """Yield when each chapter begins if they follow one another [s]."""
    begin_s = 0.0
    for chapter in story:
        yield chapter, begin_s
        begin_s += chapter.seconds(chapter.moments[-1]) + _BETWEEN_CHAPTERS_S


def _numbered(story: Sequence[Chapter]) -> Iterator[tuple[int, float, Change]]:
    number = 0
    for chapter, begin_s in _offsets(story):
        for change in chapter.changes:
            number += 1
            yield number, begin_s + chapter.seconds(change.moment), change


def _draw(axes: Axes, story: Sequence[Chapter], name: str, label: str) -> None:
    for chapter, begin_s in _offsets(story):
        times_s = [begin_s + chapter.seconds(moment) for moment in chapter.moments]
        axes.plot(times_s, [getattr(m, name) for m in chapter.moments], ".-", color="#263238", lw=1)
        ends_s = [*times_s[1:], times_s[-1] + 0.5]
        for begin, end, moment in zip(times_s, ends_s, chapter.moments, strict=True):
            axes.axvspan(begin, end, color=ACTION_COLORS[moment.action], alpha=0.25, lw=0)
        for change in chapter.changes:
            axes.axvline(begin_s + chapter.seconds(change.moment), color="#263238", lw=0.4)
    if all(math.isnan(getattr(m, name)) for chapter in story for m in chapter.moments):
        axes.text(0.5, 0.5, "not in this bag", transform=axes.transAxes, ha="center")
        axes.set_yticks([])
    axes.set_ylabel(label)
    axes.margins(x=0.01)


def _lines(changes: Sequence[tuple[int, float, Change]]) -> list[str]:
    """Return the changes by number, in lines that fit below the panels."""
    lines = []
    for number, begin_s, change in changes[:_MOST_LINES]:
        begin = f"{number:>3}  {begin_s:6.1f} s  {change.moment.action.name:<4}  "
        indent = " " * len(begin)
        lines += textwrap.wrap(
            reason(change), _LINE_LETTERS, initial_indent=begin, subsequent_indent=indent
        )
    if len(changes) > _MOST_LINES:
        lines.append(f"and {len(changes) - _MOST_LINES} more")
    return lines
