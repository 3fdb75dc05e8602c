# SPDX-License-Identifier: Apache-2.0
"""docs/results.md from results.json: every number of ours is computed, none typed."""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from sim_bridge.evaluation.cells import BASE, RANGES_M, TRAFFIC
from sim_bridge.evaluation.reporting.beside_paper import sections_beside_paper
from sim_bridge.evaluation.reporting.curiosities import curiosities
from sim_bridge.evaluation.reporting.curves import Curves
from sim_bridge.evaluation.reporting.markdown import (
    OUTCOMES,
    as_speed,
    bare,
    folded,
    number,
    percent,
    result,
    table,
    versions_table,
)
from sim_bridge.evaluation.reporting.reasons import reasons
from sim_bridge.evaluation.reporting.selection import Line, cell_of, policies, reader, spread

# Beside the page, so that it shows them wherever the project is looked at.
PICTURES = "images/results"

_INTRODUCTION = """\
# Results

<!-- Written by `make evaluate REPORT=docs/results.md`; do not edit. -->

{episodes} episodes in each cell on the map `{map}`, the same ones for every policy, none of them
seen in training. Success is the goal reached within the time limit without a collision; what is
neither success nor collision is a timeout. Brackets hold 95% intervals (Wilson's for shares); where
a policy was trained with several seeds, the number is the mean over them and the brackets enclose
the intervals of all. Mean speed is all distance over all time, so that an episode spent standing
counts by how long it lasts.

The paper does not say whether a vehicle that has left comes again, and it matters more than most of
what it does say. So both are driven: *respawning* traffic keeps coming, *finite* traffic ends. The
clairvoyant knows everything and drives the fastest way there is: the physical limit.
"""


def write_report(
    content: dict[str, Any], curves: Curves, pictures: Iterable[Path], path: Path
) -> None:
    """Write the page of a results.json; pictures are linked relative to it."""
    lines: list[Line] = content["cells"]
    episodes = max((line["episodes"] for line in lines), default=0)
    links = {file.name: Path(os.path.relpath(file, path.parent)).as_posix() for file in pictures}
    parts = [
        _INTRODUCTION.format(episodes=episodes, map=content["versions"]["map"]),
        _situations(lines),
        _ranges(lines),
        _behaviour(lines),
        *sections_beside_paper(lines, curves, links),
        _reasons(lines),
        curiosities(lines),
        versions_table(content["versions"]),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(part for part in parts if part), encoding="utf-8")


def _situations(lines: Sequence[Line]) -> str:
    """Return success, collision and timeout in each situation, the intervals folded away."""
    parts = ["## Success / collision / timeout in %\n"]
    for traffic in TRAFFIC:
        own = [line for line in lines if line["traffic"] == traffic]
        scenarios = list(dict.fromkeys(line["scenario"] for line in own))
        if not own:
            continue
        rows = [
            [policy, *(result(cell_of(own, policy, scenario, traffic)) for scenario in scenarios)]
            for policy in policies(own)
        ]
        header = [f"{traffic} traffic", *(scenario.replace("_", " ") for scenario in scenarios)]
        details = [_details(own, scenario, traffic) for scenario in scenarios]
        parts.append(table(header, rows))
        parts.append(folded(f"With intervals, {traffic} traffic", "\n".join(details)))
    return "\n".join(parts)


_DETAILS = (
    *((f"{name} in %", reader(name), percent) for name in OUTCOMES),
    ("mean speed in m/s", reader("mean_speed_mps"), number),
    ("crossing time in s", reader("crossing_time_s"), number),
)


def _details(
    lines: Sequence[Line], scenario: str, traffic: str, range_m: float | None = None
) -> str:
    rows = []
    for policy in policies(lines):
        cell = cell_of(lines, policy, scenario, traffic, range_m)
        if cell:
            rows.append([policy, *(show(spread(cell, read)) for _, read, show in _DETAILS)])
    name = scenario.replace("_", " ") if range_m is None else f"range {range_m:g} m"
    return table([f"**{name}**", *(title for title, _, _ in _DETAILS)], rows)


def _ranges(lines: Sequence[Line]) -> str:
    if not any(line["sensor_range_m"] in RANGES_M for line in lines):
        return ""
    parts = ["## Sensor range: success / collision / timeout in %, mean speed\n"]
    for traffic in TRAFFIC:
        own = [line for line in lines if line["traffic"] == traffic and line["scenario"] == BASE]
        rows = []
        for policy in policies(own):
            cells = [cell_of(own, policy, BASE, traffic, range_m) for range_m in RANGES_M]
            speeds = [spread(cell, reader("mean_speed_mps")) for cell in cells]
            shown = (
                f"{result(cell)}, {bare(speed, as_speed)}"
                for cell, speed in zip(cells, speeds, strict=True)
            )
            rows.append([policy, *shown])
        parts.append(table([f"{traffic} traffic", *(f"{each:g} m" for each in RANGES_M)], rows))
        details = [_details(own, BASE, traffic, range_m) for range_m in RANGES_M]
        parts.append(folded(f"With intervals, {traffic} traffic", "\n".join(details)))
    return "\n".join(parts)


_BEHAVIOUR = (
    ("mean speed in m/s", reader("mean_speed_mps"), number),
    ("crossing time in s", reader("crossing_time_s"), number),
    ("stop in % of decisions", lambda line: line["action_share"]["stop"], percent),
    ("slow in %", lambda line: line["action_share"]["slow"], percent),
    ("fast in %", lambda line: line["action_share"]["fast"], percent),
    ("switches an episode", reader("switches_per_episode"), number),
    ("hard brakes in %", reader("hard_brake_share"), percent),
    ("least time gap in s", reader("min_time_gap_s"), number),
)


def _behaviour(lines: Sequence[Line]) -> str:
    """Return how the policies drive, a column each: there are more quantities than policies."""
    if not any(line["scenario"] == BASE for line in lines):
        return ""
    note = "Shares are of decisions; a hard brake takes more than 1 m/s off in one.\n"
    parts = [f"## How they drive (base)\n\n{note}"]
    for traffic in TRAFFIC:
        cells = {policy: cell_of(lines, policy, traffic=traffic) for policy in policies(lines)}
        driven = {policy: cell for policy, cell in cells.items() if cell}
        rows = [
            [title, *(show(spread(cell, read)) for cell in driven.values())]
            for title, read, show in _BEHAVIOUR
        ]
        if driven:
            parts.append(table([f"{traffic} traffic", *driven], rows))
    return "\n".join(parts)


def _reasons(lines: Sequence[Line]) -> str:
    told = reasons(lines)
    return f"## Why\n\n{told}" if told else ""
