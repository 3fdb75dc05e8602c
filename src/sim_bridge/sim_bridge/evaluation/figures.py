# SPDX-License-Identifier: Apache-2.0
"""The paper's four figures from our results, the paper's own values beside them, as PNG."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim_bridge.evaluation.cells import BASE, CHALLENGES, FINITE, RANGES_M, RESPAWNING, TRAFFIC
from sim_bridge.evaluation.paper_values import (
    ACTION_USAGE,
    CHALLENGING,
    MEAN_SPEED_MPS,
    RULE_BASED,
    paper_role,
)
from sim_bridge.evaluation.selection import (
    Line,
    Spread,
    actions_normalised,
    cell_of,
    policies,
    reader,
    spread,
)

HISTORY = "history.json"
_INCHES = (11.0, 4.2)
_SMOOTHED_OVER = 9
_COLORS = ("#E84325", "#E88C25", "#09765E", "#2B6CB0", "#7A5195", "#808080", "#B08D57", "#333333")

# label -> position of the bar's group -> value
Bars = Mapping[str, Mapping[str, Spread | float | None]]


def draw_figures(lines: Sequence[Line], training: Path, folder: Path) -> list[Path]:
    """Draw all figures for which there is something to draw; return their files.

    lines: cells of results.json. training: folder of training runs, each with history.json.
    """
    folder.mkdir(parents=True, exist_ok=True)
    drawn = [
        _training(training, folder / "success_during_training.png"),
        _actions(lines, folder / "action_usage.png"),
        _challenges(lines, folder / "challenging_groups.png"),
        _speeds(lines, folder / "mean_speed_by_range.png"),
    ]
    return [path for path in drawn if path is not None]


def _training(folder: Path, path: Path) -> Path | None:
    """Success of the running evaluation over training steps, a band over seeds."""
    runs: dict[str, list[tuple[Any, Any]]] = {}
    for file in sorted(folder.glob(f"*/{HISTORY}")):
        curve = _curve(json.loads(file.read_text(encoding="utf-8")))
        if curve is not None:
            runs.setdefault(file.parent.name.partition("_seed")[0], []).append(curve)
    if not runs:
        return None
    figure, (axes,) = _figure("Success during training", 1)
    for (name, curves), color in zip(sorted(runs.items()), _cycled(), strict=False):
        last = min(steps[-1] for steps, _ in curves)
        grid = np.linspace(0.0, last, 200)
        success = np.array([np.interp(grid, steps, rates) for steps, rates in curves])
        axes.plot(grid, success.mean(axis=0), color=color, label=f"{name} ({len(curves)} seeds)")
        axes.fill_between(grid, success.min(axis=0), success.max(axis=0), color=color, alpha=0.2)
    axes.set(xlabel="training steps", ylabel="success rate", ylim=(0.0, 1.02))
    return _save(figure, path)


def _curve(records: Sequence[Mapping[str, Any]]) -> tuple[Any, Any] | None:
    """Return steps and smoothed success (K,) of a run; 20 episodes a point are a noisy measure."""
    if len(records) < 2:
        return None
    steps = np.array([record["steps"] for record in records], dtype=np.float64)
    success = np.array([record["evaluation"]["success"] for record in records])
    window = np.ones(min(_SMOOTHED_OVER, len(records)))
    smooth = np.convolve(success, window, "same") / np.convolve(
        np.ones(len(records)), window, "same"
    )
    return steps, smooth


def _actions(lines: Sequence[Line], path: Path) -> Path | None:
    reference = cell_of(lines, RULE_BASED)
    if not reference:
        return None
    figure, axes = _figure("Number of actions, normalised by the rule-based policy", 2)
    for place, traffic in zip(axes, TRAFFIC, strict=True):
        bars: dict[str, Mapping[str, Spread | float | None]] = {}
        reference = cell_of(lines, RULE_BASED, traffic=traffic)
        for policy in policies(lines):
            ours = actions_normalised(cell_of(lines, policy, traffic=traffic), reference)
            _add(bars, policy, ours, ACTION_USAGE)
        _bars(place, ("fast", "slow", "stop"), bars)
        place.set(title=f"{traffic} traffic", ylabel="relative to rule-based")
    return _save(figure, path)


def _challenges(lines: Sequence[Line], path: Path) -> Path | None:
    if not any(line["scenario"] in CHALLENGES for line in lines):
        return None
    figure, axes = _figure("Success in challenging situations", 2)
    for place, traffic in zip(axes, TRAFFIC, strict=True):
        bars: dict[str, Mapping[str, Spread | float | None]] = {}
        for policy in policies(lines):
            ours = {
                scenario: spread(cell_of(lines, policy, scenario, traffic), reader("success"))
                for scenario in CHALLENGES
            }
            _add(bars, policy, ours, CHALLENGING)
        _bars(place, CHALLENGES, bars)
        place.set(title=f"{traffic} traffic", ylabel="success rate", ylim=(0.0, 1.05))
    return _save(figure, path)


def _speeds(lines: Sequence[Line], path: Path) -> Path | None:
    if not any(line["sensor_range_m"] in RANGES_M for line in lines):
        return None
    figure, axes = _figure("Mean speed by sensor range", 2)
    groups = [f"{range_m:g} m" for range_m in RANGES_M]
    for place, traffic in zip(axes, (RESPAWNING, FINITE), strict=True):
        bars: dict[str, Mapping[str, Spread | float | None]] = {}
        for policy in policies(lines):
            ours = {
                group: spread(
                    cell_of(lines, policy, BASE, traffic, range_m), reader("mean_speed_mps")
                )
                for group, range_m in zip(groups, RANGES_M, strict=True)
            }
            theirs = {
                role: {f"{range_m:g} m": value for range_m, value in values.items()}
                for role, values in MEAN_SPEED_MPS.items()
            }
            _add(bars, policy, ours, theirs)
        _bars(place, groups, bars)
        place.set(title=f"{traffic} traffic", ylabel="mean speed [m/s]", ylim=(0.0, None))
    return _save(figure, path)


def _add(
    bars: dict[str, Mapping[str, Spread | float | None]],
    policy: str,
    ours: Mapping[str, Spread | float | None],
    theirs: Mapping[str, Mapping[str, float]],
) -> None:
    """Add the bars of a policy and, if it is one of the paper's, the paper's values beside."""
    bars[policy] = ours
    role = paper_role(policy)
    if role is not None and role in theirs:
        bars[f"{role}, paper"] = theirs[role]


def _cycled() -> list[str]:
    return [_COLORS[k % len(_COLORS)] for k in range(64)]


def _figure(title: str, count: int) -> tuple[Figure, list[Axes]]:
    # No window system is asked for anything.
    figure = Figure(figsize=_INCHES, layout="constrained")
    axes = figure.subplots(1, count, squeeze=False)
    figure.suptitle(title)
    return figure, list(axes[0])


def _bars(axes: Axes, groups: Sequence[str], bars: Bars) -> None:
    """Draw groups of bars; values of the paper are hatched in the colour of ours before them."""
    width = 0.84 / max(len(bars), 1)
    color = -1
    for k, (label, values) in enumerate(bars.items()):
        of_paper = label.endswith(", paper")
        color += not of_paper
        for g, group in enumerate(groups):
            value = values.get(group)
            if value is None:
                continue
            height = value.value if isinstance(value, Spread) else value
            at = g - 0.42 + (k + 0.5) * width
            paint = _cycled()[color]
            axes.bar(
                at,
                height,
                width,
                color="white" if of_paper else paint,
                edgecolor=paint,
                hatch="///" if of_paper else None,
                label=label if g == 0 else None,
            )
            if isinstance(value, Spread):
                around = [[max(height - value.low, 0.0)], [max(value.high - height, 0.0)]]
                axes.errorbar(at, height, around, color="black", linewidth=0.8, capsize=2)
            axes.annotate(f"{height:.2f}", (at, height), ha="center", va="bottom", fontsize=6)
    axes.set_xticks(range(len(groups)), [group.replace("_", "\n") for group in groups])


def _save(figure: Figure, path: Path) -> Path:
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=8)
    with mpl.rc_context({"svg.hashsalt": "0"}):
        figure.savefig(path, dpi=110, metadata={"Software": ""})
    return path
