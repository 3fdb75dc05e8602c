# SPDX-License-Identifier: Apache-2.0
"""The look of the figures: colours that all eyes tell apart, bars with intervals, legends."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from sim_bridge.evaluation.reporting.paper_values import (
    COLLISION_AWARE,
    RISK_AWARE,
    RULE_BASED,
    paper_role,
)
from sim_bridge.evaluation.reporting.selection import Spread

# Okabe and Ito's palette, made to be told apart with any kind of colour vision.
_ROLE_COLORS = {RULE_BASED: "#D55E00", COLLISION_AWARE: "#E69F00", RISK_AWARE: "#009E73"}
_TUNED_COLOR = "#0072B2"
_OTHER_COLORS = ("#56B4E9", "#CC79A7", "#F0E442", "#999999")
_LIMIT_COLOR = "#000000"
_COLLISION_COLOR = "#444444"
WIDTH_IN = 9.0
_DPI = 120
_GROUP_WIDTH = 0.84

# Position of the bar's group -> value
Values = Mapping[str, Spread | None]


def colors(policies: Iterable[str]) -> dict[str, str]:
    """Return a colour for each policy; those of the paper and `tuned` always have the same."""
    found, others = {}, 0
    for policy in policies:
        role = paper_role(policy)
        if role is not None:
            found[policy] = _ROLE_COLORS[role]
        elif policy.endswith("tuned"):
            found[policy] = _TUNED_COLOR
        else:
            found[policy] = _OTHER_COLORS[others % len(_OTHER_COLORS)]
            others += 1
    return found


def new_figure(title: str, rows: int, height_in: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with panels below each other, sharing their places along x."""
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    axes = figure.subplots(rows, 1, squeeze=False)[:, 0]
    figure.suptitle(title, fontsize=13)
    for place in axes:
        place.spines[["top", "right"]].set_visible(False)
        place.grid(axis="y", color="#DDDDDD", linewidth=0.8)
        place.set_axisbelow(True)
    return figure, list(axes)


class Bars:
    """Groups of bars on axes: one bar a policy in each group, the paper's values as diamonds."""

    def __init__(self, axes: Axes, groups: Sequence[str], policies: Sequence[str]) -> None:
        self._axes = axes
        self._groups = list(groups)
        self._policies = list(policies)
        self._width = _GROUP_WIDTH / max(len(policies), 1)
        self._colors = colors(policies)
        names = [group.replace("_", " ") for group in groups]
        axes.set_xticks(range(len(groups)), names, fontsize=11)
        axes.tick_params(axis="x", length=0)

    def _center(self, policy: str, group: str) -> float:
        place = self._policies.index(policy)
        left = self._groups.index(group) - 0.5 * _GROUP_WIDTH
        return left + (place + 0.5) * self._width

    def add(self, policy: str, values: Values) -> None:
        """Draw a policy's bars with their intervals and numbers."""
        for group, value in values.items():
            if value is None:
                continue
            at = self._center(policy, group)
            self._axes.bar(at, value.value, 0.92 * self._width, color=self._colors[policy])
            around = [[max(value.value - value.low, 0.0)], [max(value.high - value.value, 0.0)]]
            self._axes.errorbar(at, value.value, around, color="black", linewidth=1.0, capsize=2.5)
            top = max(value.high, value.value)
            self._axes.annotate(
                f"{value.value:.2f}", (at, top), (0, 2), textcoords="offset points",
                ha="center", va="bottom", fontsize=8,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.8},
            )  # fmt: skip

    def stack(self, policy: str, bottoms: Values, values: Values) -> None:
        """Draw hatched parts that end at the top of the axes' unit range, above `bottoms`."""
        for group, value in values.items():
            below = bottoms.get(group)
            if value is None or below is None or value.value <= 0.0:
                continue
            self._axes.bar(
                self._center(policy, group), value.value, 0.92 * self._width,
                bottom=1.0 - value.value, color="white", edgecolor=_COLLISION_COLOR,
                hatch="xxxxx", linewidth=0.8,
            )  # fmt: skip

    def paper(self, policy: str, values: Mapping[str, float]) -> None:
        """Mark the values that the paper states for a policy, beside our number and interval."""
        aside = 0.36 * self._width
        for group, value in values.items():
            self._axes.plot(
                self._center(policy, group) + aside, value, marker="D", markersize=6.5,
                color=self._colors[policy], markeredgecolor="black", markeredgewidth=1.4, zorder=5,
                clip_on=False,
            )  # fmt: skip

    def limit(self, values: Values) -> None:
        """Draw a line over each group: what is physically possible there."""
        for group, value in values.items():
            if value is not None:
                at = self._groups.index(group)
                ends = (at - 0.5 * _GROUP_WIDTH, at + 0.5 * _GROUP_WIDTH)
                self._axes.hlines(value.value, *ends, color=_LIMIT_COLOR, linestyle=(0, (4, 2)))


def legend(figure: Figure, policies: Mapping[str, str], **more: Artist) -> None:
    """Explain the policies' colours by their labels, the paper's marks, intervals and `more`."""
    shades = colors(policies)
    entries: list[tuple[Artist, str]] = [
        (Patch(color=shades[policy]), label) for policy, label in policies.items()
    ]
    mark = Line2D(
        [], [], linestyle="", marker="D", color="white", markeredgecolor="black",
        markeredgewidth=1.4, markersize=7,
    )  # fmt: skip
    entries.append((mark, "the paper's value, in the policy's colour"))
    entries += [(artist, label) for label, artist in more.items()]
    handles, labels = zip(*entries, strict=True)
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=9.5, frameon=False)


def interval_mark() -> Line2D:
    """Return the legend's sign for an interval."""
    return Line2D([], [], color="black", linestyle="", marker="|", markersize=12)


def limit_mark() -> Line2D:
    """Return the legend's sign for the clairvoyant."""
    return Line2D([], [], color=_LIMIT_COLOR, linestyle=(0, (4, 2)))


def collision_mark() -> Patch:
    """Return the legend's sign for collisions."""
    return Patch(facecolor="white", edgecolor=_COLLISION_COLOR, hatch="xxxxx")


def save(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG, the same bytes each time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=_DPI, metadata={"Software": ""})
    return path
