# SPDX-License-Identifier: Apache-2.0
"""The picture of a soak: each process' memory along the simulated time."""

from pathlib import Path

from matplotlib.figure import Figure

from sim_bridge.ros.soak.trend import Limits
from sim_bridge.ros.soak.verdict import Soak

# Okabe and Ito's palette, made to be told apart with any kind of colour vision.
_COLORS = ("#0072B2", "#D55E00", "#009E73")
_SIZE_IN, _DPI = (9.0, 4.0), 120


def draw_memory(soak: Soak, limits: Limits, title: str, file: Path) -> None:
    """Write the picture, a PNG; the warm-up, which does not count, is shaded."""
    figure = Figure(figsize=_SIZE_IN, layout="constrained")
    axes = figure.add_subplot()
    minutes = [sample.driven_s / 60.0 for sample in soak.samples]
    for name, color in zip(soak.samples[0].usage, _COLORS, strict=False):
        memory_mb = [sample.usage[name].resident_bytes / 1e6 for sample in soak.samples]
        axes.plot(minutes, memory_mb, color=color, linewidth=1.2, label=name)
    warm_up = minutes[0] + limits.warm_up * (minutes[-1] - minutes[0])
    axes.axvspan(minutes[0], warm_up, color="#EEEEEE", label="warm-up")
    axes.set_xlabel("simulated time [min]")
    axes.set_ylabel("memory present [MB]")
    axes.set_ylim(bottom=0.0)
    axes.set_title(title, fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#DDDDDD", linewidth=0.8)
    axes.legend(frameon=False, ncols=4, fontsize=8)
    figure.savefig(file, dpi=_DPI)
