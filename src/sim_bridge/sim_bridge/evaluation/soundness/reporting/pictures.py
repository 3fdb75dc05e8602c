# SPDX-License-Identifier: Apache-2.0
"""What accepted risk buys, as a picture: collisions against success and crossing time."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sim_bridge.evaluation.clairvoyant import NAME as CLAIRVOYANT
from sim_bridge.evaluation.reporting.plotting import WIDTH_IN, colors, save
from sim_bridge.evaluation.reporting.selection import Line, center_of
from sim_bridge.evaluation.soundness.limits import SOUND_LIMIT
from sim_bridge.evaluation.soundness.reporting.tables import (
    LIMITS,
    by_traffic,
    policies_of,
    top_speed,
)

FRONTIER_PNG = "accepted_risk.png"
# Rates of 0 have no place on a logarithmic axis: they stand at the interval's end.
_LEAST = 1e-5
_STYLES = {CLAIRVOYANT: (0, (1, 2)), SOUND_LIMIT: (0, (5, 2))}


def draw_frontier(lines: Sequence[Line], folder: Path) -> list[Path]:
    """Draw the frontier; return its file, or nothing if there is nothing to draw."""
    groups = by_traffic(lines)
    if not policies_of(lines):
        return []
    figure = Figure(figsize=(WIDTH_IN, 0.8 + 2.4 * len(groups)), layout="constrained")
    panels = figure.subplots(len(groups), 2, squeeze=False)
    figure.suptitle("Accepted risk: the highest speed [m/s] ascribed to hidden vehicles")
    for (left, right), (traffic, own) in zip(panels, groups.items(), strict=True):
        left.set_title(traffic, fontsize=10, loc="left")
        _panel(left, own, "success", 100.0, "success [%]")
        _panel(right, own, "crossing_time_s", 1.0, "crossing time [s]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return [save(figure, folder / FRONTIER_PNG)]


def _panel(axes: Axes, lines: Sequence[Line], key: str, factor: float, label: str) -> None:
    shades = colors(policies_of(lines))
    for policy, color in shades.items():
        own = [line for line in lines if line["policy"] == policy and line[key] is not None]
        across = [factor * center_of(line[key]) for line in own]
        up = [100 * max(line["collision"]["rate"], _LEAST) for line in own]
        ends = [
            [100 * max(line["collision"][end], _LEAST) for line in own] for end in ("low", "high")
        ]
        axes.plot(across, up, color=color, marker="o", markersize=5, label=policy)
        axes.vlines(across, ends[0], ends[1], color=color, linewidth=1.2)
        for x, y, line in zip(across, up, own, strict=True):
            text = "limit" if line["assumptions_hold"] else top_speed(line)
            axes.annotate(text, (x, y), (5, 4), textcoords="offset points", fontsize=8, color=color)
    for line in lines:
        if line["policy"] in LIMITS and line[key] is not None:
            axes.axvline(
                factor * center_of(line[key]), color="black", linewidth=1.0,
                linestyle=_STYLES[line["policy"]], label=line["policy"].replace("_", " "),
            )  # fmt: skip
    axes.set(xlabel=label, ylabel="collisions [%]", yscale="log")
    axes.set_ylim(50 * _LEAST, 100)
    axes.grid(color="#DDDDDD", linewidth=0.8)
    axes.spines[["top", "right"]].set_visible(False)
