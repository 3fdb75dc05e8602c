# SPDX-License-Identifier: Apache-2.0
"""docs/results.md from results.json: every number of it is computed, none typed."""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from sim_bridge.evaluation.cells import BASE, CHALLENGES, RANGES_M, TRAFFIC
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

_NOTHING = "–"

_INTRODUCTION = """\
# Results

<!-- Written by `evaluate --report`; do not edit. -->

{episodes} episodes in each cell, the same ones for every policy, none of them seen in training.
Brackets hold 95% intervals (Wilson's for shares); where a policy was trained with several seeds,
the number is the mean over them and the brackets hold the lowest and the highest seed. Success is
the goal reached within the time limit without a collision; what is neither success nor collision
is a timeout. Mean speed is all distance over all time, so that an episode spent standing counts
by how long it lasts. The clairvoyant knows everything and drives the optimum: the physical limit.
"""

_FIGURES = (
    ("success_during_training.png", "Success during training"),
    ("action_usage.png", "Action usage"),
    ("challenging_groups.png", "Challenging situations"),
    ("mean_speed_by_range.png", "Mean speed by sensor range"),
)

_CURIOSITIES = """\
## Curiosities of the paper

Named here so that nobody looks for the fault elsewhere:

- The rule-based policy's speed falls from 2.16 to 1.25 m/s as the sensor range *grows* from 60 to
  90 m. More sight can only make Algorithm 1 bolder.
- It is 0.0 m/s at 40 m, although the ego must at least have driven to the stop line.
- Success rates come in steps of 0.1, so each rests on 10 to 20 episodes: an interval of some
  +-0.2. Not all differences between its bars are larger than that.
- The text says the collision-aware DQN uses more stop actions than the others, the figure says
  fewer than the rule-based policy (0.16 against 1).
- Collision and success are rewarded with -200 and +100 in one place and -2 and +1 in another.
"""


def write_report(content: dict[str, Any], figures: Path, path: Path) -> None:
    """Write the page; pictures in the folder `figures` are linked relative to it."""
    lines: list[Line] = content["cells"]
    episodes = max((line["episodes"] for line in lines), default=0)
    parts = [_INTRODUCTION.format(episodes=episodes)]
    parts += [_situations(lines, traffic) for traffic in TRAFFIC]
    parts += [_ranges(lines), _behaviour(lines), _beside_the_paper(lines)]
    parts += [_picture(figures, path, name, title) for name, title in _FIGURES]
    parts += [_CURIOSITIES, _versions(content["versions"])]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(part for part in parts if part), encoding="utf-8")


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _percent(value: Spread | None) -> str:
    if value is None:
        return _NOTHING
    return f"{100 * value.value:.1f} [{100 * value.low:.1f}, {100 * value.high:.1f}]"


def _number(value: Spread | None) -> str:
    if value is None:
        return _NOTHING
    return f"{value.value:.2f} [{value.low:.2f}, {value.high:.2f}]"


def _result(lines: Sequence[Line]) -> str:
    """Return success, collision and timeout of one cell, never one without the others."""
    if not lines:
        return _NOTHING
    keys = ("success", "collision", "timeout")
    spreads = [spread(lines, reader(key)) for key in keys]
    return " / ".join(_percent(value) for value in spreads)


def _situations(lines: Sequence[Line], traffic: str) -> str:
    own = [line for line in lines if line["traffic"] == traffic]
    scenarios = list(dict.fromkeys(line["scenario"] for line in own))
    if not own:
        return ""
    title = f"## {traffic.capitalize()} traffic: success / collision / timeout in %\n"
    rows = [
        [policy, *(_result(cell_of(own, policy, scenario, traffic)) for scenario in scenarios)]
        for policy in policies(own)
    ]
    return f"{title}\n{_table(['policy', *scenarios], rows)}"


def _ranges(lines: Sequence[Line]) -> str:
    if not any(line["sensor_range_m"] in RANGES_M for line in lines):
        return ""
    header = ["policy", "traffic"]
    for range_m in RANGES_M:
        header += [f"{range_m:g} m: S / C / T in %", f"{range_m:g} m: speed in m/s"]
    rows = []
    for policy in policies(lines):
        for traffic in TRAFFIC:
            row = [policy, traffic]
            for range_m in RANGES_M:
                cell = cell_of(lines, policy, BASE, traffic, range_m)
                row += [_result(cell), _number(spread(cell, reader("mean_speed_mps")))]
            rows.append(row)
    return f"## Sensor range\n\n{_table(header, rows)}"


_BEHAVIOUR = (
    ("mean speed in m/s", reader("mean_speed_mps"), _number),
    ("crossing time in s", reader("crossing_time_s"), _number),
    ("stop in %", lambda line: line["action_share"]["stop"], _percent),
    ("slow in %", lambda line: line["action_share"]["slow"], _percent),
    ("fast in %", lambda line: line["action_share"]["fast"], _percent),
    ("switches an episode", reader("switches_per_episode"), _number),
    ("hard brakes in %", reader("hard_brake_share"), _percent),
    ("least time gap in s", reader("min_time_gap_s"), _number),
)


def _behaviour(lines: Sequence[Line]) -> str:
    if not any(line["scenario"] == BASE for line in lines):
        return ""
    rows = []
    for traffic in TRAFFIC:
        for policy in policies(lines):
            cell = cell_of(lines, policy, traffic=traffic)
            values = [show(spread(cell, read)) for _, read, show in _BEHAVIOUR]
            rows.append([policy, traffic, *values])
    header = ["policy", "traffic", *(name for name, _, _ in _BEHAVIOUR)]
    note = "Shares are of decisions; a hard brake takes more than 1 m/s off in one.\n"
    return f"## How they drive (base)\n\n{note}\n{_table(header, rows)}"


def _beside_the_paper(lines: Sequence[Line]) -> str:
    """Return each number that the paper's figures state beside ours."""
    rows = []
    for policy in policies(lines):
        role = paper_role(policy)
        if role is None:
            continue
        for action, value in ACTION_USAGE[role].items():
            ours = [
                actions_normalised(
                    cell_of(lines, policy, traffic=traffic),
                    cell_of(lines, RULE_BASED, traffic=traffic),
                ).get(action)
                for traffic in TRAFFIC
            ]
            shown = [_NOTHING if own is None else f"{own:.2f}" for own in ours]
            rows.append([policy, f"{action} actions, rule-based = 1", f"{value:.2f}", *shown])
        for scenario in CHALLENGES:
            success = CHALLENGING.get(role, {}).get(scenario)
            if success is not None:
                shown = [_result(cell_of(lines, policy, scenario, each)) for each in TRAFFIC]
                rows.append([policy, f"success in {scenario}, %", f"{100 * success:.0f}", *shown])
        for range_m, speed in MEAN_SPEED_MPS.get(role, {}).items():
            cells = [cell_of(lines, policy, BASE, each, range_m) for each in TRAFFIC]
            shown = [_number(spread(cell, reader("mean_speed_mps"))) for cell in cells]
            rows.append([policy, f"mean speed at {range_m:g} m, m/s", f"{speed:.2f}", *shown])
    if not rows:
        return ""
    header = ["policy", "what", "paper", *(f"ours, {traffic}" for traffic in TRAFFIC)]
    note = "Of ours, where the paper has a success rate: success / collision / timeout.\n"
    return f"## Beside the paper\n\n{note}\n{_table(header, rows)}"


def _picture(figures: Path, path: Path, name: str, title: str) -> str:
    file = figures / name
    if not file.is_file():
        return ""
    link = Path(os.path.relpath(file, path.parent)).as_posix()
    return f"![{title}]({link})\n"


def _versions(versions: dict[str, Any]) -> str:
    shown = ("git_revision", "python", "numpy", "numba", "map", "first_seed")
    rows = [[name, str(versions[name])] for name in shown if name in versions]
    return f"## Made with\n\n{_table(['what', 'version'], rows)}"
