# SPDX-License-Identifier: Apache-2.0
"""The picture of an episode: four moments from above, and speed and decisions along time."""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from risk_dqn_planner.decision import Action
from risk_dqn_planner.intersection.model import IntersectionModel
from sim_bridge.rendering.frames import Frame
from sim_bridge.rendering.top_view import (
    ACTION_COLORS,
    draw_frame,
    draw_intersection,
    look_at,
    zone_center,
)

_HALF_WIDTH_M = 42.0
_WIDTH_IN, _HEIGHT_IN, _DPI = 13.0, 5.6, 110
_MOMENTS = 4


def save_episode_picture(
    model: IntersectionModel, frames: Sequence[Frame], path: Path, title: str = ""
) -> None:
    """Write the picture of an episode, a PNG.

    Raises:
        ValueError: there is no frame.
    """
    if not frames:
        raise ValueError("an episode without frames has no picture")
    figure = Figure(figsize=(_WIDTH_IN, _HEIGHT_IN), layout="constrained")
    grid = figure.add_gridspec(2, _MOMENTS, height_ratios=(4.0, 1.0))
    for column, frame in enumerate(key_moments(model, frames)):
        axes = figure.add_subplot(grid[0, column])
        _draw_moment(axes, model, frames, frame)
    _draw_course(figure.add_subplot(grid[1, :]), frames)
    if title:
        figure.suptitle(title, fontsize=11, y=0.995)
        figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 0.94))
    figure.legend(
        handles=_legend(), loc="outside lower center", ncols=12, fontsize=7, frameon=False
    )
    figure.savefig(path, dpi=_DPI)


def frame_image(model: IntersectionModel, frame: Frame, size_px: int = 480) -> NDArray[np.uint8]:
    """Return one moment from above as an image (size_px, size_px, 3)."""
    figure = Figure(figsize=(size_px / _DPI, size_px / _DPI), dpi=_DPI)
    canvas: Any = FigureCanvasAgg(figure)  # untyped in matplotlib
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    draw_intersection(axes, model)
    draw_frame(axes, frame)
    look_at(axes, zone_center(model), _HALF_WIDTH_M)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def key_moments(model: IntersectionModel, frames: Sequence[Frame]) -> list[Frame]:
    """Return four moments: most is hidden, arrival at the stop line, first zone, end."""
    line = model.ego_path.centerline
    s = np.array([line.project(frame.ego.x_m, frame.ego.y_m).s for frame in frames])
    first_zone = min(lane.ego_zone_center_m for lane in model.lanes)
    last = len(frames) - 1
    at_line = min(int(np.searchsorted(s, model.stop_line.position_m - 3.0)), last)
    in_zone = min(int(np.searchsorted(s, first_zone)), last)
    hidden = [_hidden_in_view(model, frame) for frame in frames[: at_line + 1]]
    return [frames[index] for index in (int(np.argmax(hidden)), at_line, in_zone, last)]


def _hidden_in_view(model: IntersectionModel, frame: Frame) -> int:
    x, y = zone_center(model)
    return sum(
        vehicle.hidden and max(abs(vehicle.x_m - x), abs(vehicle.y_m - y)) < _HALF_WIDTH_M
        for vehicle in frame.vehicles
    )


def _draw_moment(
    axes: Axes, model: IntersectionModel, frames: Sequence[Frame], frame: Frame
) -> None:
    draw_intersection(axes, model)
    past = [each for each in frames if each.time_s <= frame.time_s]
    for each in past[:: max(len(past) // 60, 1)]:
        color = "#90a4ae" if each.action is None else ACTION_COLORS[each.action]
        axes.plot(each.ego.x_m, each.ego.y_m, ".", color=color, ms=3.0, zorder=4)
    draw_frame(axes, frame)
    look_at(axes, _view_center(model, frame), _HALF_WIDTH_M)
    name = "-" if frame.action is None else frame.action.name
    axes.set_title(f"{frame.time_s:.1f} s  {name}  {frame.ego.speed_mps:.1f} m/s", fontsize=9)
    axes.set_xlabel("\n".join(_wrapped(frame.reason)), fontsize=6.5)


def _view_center(model: IntersectionModel, frame: Frame) -> tuple[float, float]:
    """Look at the intersection, but never lose the ego."""
    x, y = zone_center(model)
    reach = _HALF_WIDTH_M - 6.0
    dx, dy = frame.ego.x_m - x, frame.ego.y_m - y
    return (x + dx - np.clip(dx, -reach, reach), y + dy - np.clip(dy, -reach, reach))


def _wrapped(text: str, width: int = 56) -> list[str]:
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) > width:
            lines.append("")
        lines[-1] += f"{word} "
    return lines[:3]


def _draw_course(axes: Axes, frames: Sequence[Frame]) -> None:
    times = np.array([frame.time_s for frame in frames])
    axes.plot(times, [frame.ego.speed_mps for frame in frames], color="#1565c0", lw=1.5)
    axes.set_xlim(times[0], max(times[-1], times[0] + 0.1))
    axes.set_ylim(0.0, 6.0)
    axes.set_xlabel("time [s]", fontsize=8)
    axes.set_ylabel("speed [m/s]", fontsize=8)
    axes.tick_params(labelsize=7)
    for now, then in itertools.pairwise(frames):
        if now.action is not None:
            axes.axvspan(now.time_s, then.time_s, color=ACTION_COLORS[now.action], alpha=0.25, lw=0)


def _legend() -> list[Patch | Line2D]:
    return [
        _box("#1565c0", "ego"),
        _box("#37474f", "vehicle that is seen"),
        Patch(facecolor="none", edgecolor="#37474f", ls="--", label="hidden vehicle"),
        _box("#5d6d7e", "obstacle"),
        _box("#fff3b0", "visible area"),
        _box("#e57373", "crossing zone", 0.5),
        _box("#ba68c8", "merging zone", 0.5),
        Line2D([], [], color="#b71c1c", label="stop line (dotted: derived)"),
        Line2D([], [], color="#2e7d32", label="goal"),
        *(_box(ACTION_COLORS[action], action.name.title(), 0.5) for action in Action),
    ]


def _box(color: str, label: str, alpha: float = 1.0) -> Patch:
    return Patch(facecolor=color, edgecolor="none", alpha=alpha, label=label)
