# SPDX-License-Identifier: Apache-2.0
"""docs/soundness.md from the results.json of the set: every number is computed, none typed."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sim_bridge.evaluation.cells import BASE
from sim_bridge.evaluation.reporting.markdown import folded, table, versions_table
from sim_bridge.evaluation.reporting.selection import Line
from sim_bridge.evaluation.soundness.cells import FRONTIER, GOAL, GRANTED, MEMORY, VIOLATED
from sim_bridge.evaluation.soundness.limits import SOUND_LIMIT
from sim_bridge.evaluation.soundness.reporting.pictures import draw_frontier
from sim_bridge.evaluation.soundness.reporting.tables import (
    LIMITS,
    SPEED_WANTED,
    SUCCESS_WANTED,
    at_a_glance,
    by_map,
    by_traffic,
    cells_reached,
    collisions_in_all,
    full,
    limits_of,
    outcome,
    part_of,
    policies_of,
    reached,
    smoothness,
    timeouts,
    top_speed,
    where,
    with_interval,
)

PICTURES = "images/soundness"

_INTRODUCTION = """\
# Soundness, measured

<!-- Written by `make evaluate SET=soundness REPORT=docs/soundness.md`; do not edit. -->

[safety.md](safety.md) argues why an ego that follows the joint check cannot collide in a world that
keeps its assumptions. This page looks for the opposite, and says what the promise costs: up to
{episodes} episodes in each cell, none of them seen in training, and the same ones for every policy,
but for those that take longer to decide, which drive the first of them only (how many each drove
stands under *Collisions*). Brackets hold 95% intervals.
*Centre* and *front* say where the sensor is on the ego; where speeds are perceived with noise the
check allows for errors of 4 standard deviations.

`fastest_sound`, `look_ahead`, `sound_dqn` and whatever ends in `+supervisor` take sound actions
only. The others are there for contrast.
"""

_GLANCE = """\
## At a glance

Means over all cells with the sensor at the ego's centre, each cell counting as much as any other;
*of all decisions* counts each decision as much as any other, so that long episodes weigh more. A
hard brake takes more than 1 m/s off in one decision.
"""

_LIMITS = """\
## What is possible

Success in % of the clairvoyant / of the sound limit, over the first {episodes} episodes of each
cell. The clairvoyant knows all traffic and takes the fastest way there is. The sound limit is the
fastest way on which every action passes the joint check with what the ego perceives there and
then: the ceiling of any supervised policy. Both are driven in the simulation. Where traffic reacts
to the ego (maps with merging lanes), and for the sound limit everywhere, ways are found by a beam
search over copies of the episode: what is found exists, what is not found may. What any policy
reached counts as found, for the sound limit what a sound one did.
"""

_REACHED = """\
## How much of it is reached

Success and mean speed in % of the sound limit's, in the same episodes.
Below {success:.0f} and {speed:.0f} in *italics*. First in how many cells each policy is not below.
"""

_TIMEOUTS = """\
## Why episodes time out

*Impossible*: the clairvoyant does not get through either. *Price of soundness*: it does, but no
sound way was found. *Missed*: there is a sound way. Over all cells above, in the episodes whose
limits were searched.
"""

_MEMORY = """\
## With memory of what was seen

`tracked` remembers where no hidden vehicle can be, see [hidden_space.md](hidden_space.md);
`instantaneous` is the paper's reading, without memory. The sound limit with memory is that of an
ego that remembers its own way; of two ways to the same place and speed one is followed.
"""

_FRONTIER = """\
## Accepted risk

Under severe occlusion the worst case forbids most. `hidden_top_speed_mps` caps the speed that is
ascribed to hidden vehicles: lower values accept the risk that one is faster. The last rows accept
none. Map `{map}`, sensor at the centre. Where nothing collided the mark stands at the picture's
foot, and the line above it is the interval.
"""

_VIOLATED = """\
## Where assumptions are broken

Each scenario breaks one thing that the check takes for granted; the check does not know. `base`
keeps all, for comparison. Collisions here break no promise.
"""

_GRANTED = """\
## Where the check is told

The same worlds, with `SafetyAssumptions` that grant what each does: the delay, the weaker braking,
the higher speeds, the bias. So they keep their assumptions, and nobody may collide; what that costs
is success and speed.
"""


def write_soundness(content: dict[str, Any], folder: Path, report: Path | None) -> list[Path]:
    """Draw the pictures into a folder, and write the page with its own if it is asked for."""
    lines: list[Line] = content["cells"]
    drawn = draw_frontier(part_of(lines, FRONTIER), folder)
    if report is None:
        return drawn
    pictures = draw_frontier(part_of(lines, FRONTIER), report.parent / PICTURES)
    links = [Path(os.path.relpath(file, report.parent)).as_posix() for file in pictures]
    episodes = max((line["episodes"] for line in lines if line["policy"] not in LIMITS), default=0)
    parts = [
        _INTRODUCTION.format(episodes=episodes),
        _promise(part_of(lines, GOAL)),
        _limits(part_of(lines, GOAL)),
        _smooth(part_of(lines, GOAL)),
        _memory(part_of(lines, MEMORY), part_of(lines, GOAL)),
        _frontier(part_of(lines, FRONTIER), links),
        _violated(part_of(lines, VIOLATED)),
        _granted(part_of(lines, GRANTED)),
        _versions(content["versions"]),
    ]
    report.parent.mkdir(parents=True, exist_ok=True)
    report.write_text("\n".join(part for part in parts if part), encoding="utf-8")
    return [*drawn, *pictures, report]


def _promise(lines: Sequence[Line]) -> str:
    if not lines:
        return ""
    tables = [by_map(lines, policy, outcome, f"`{policy}`") for policy in policies_of(lines)]
    return "\n".join(
        (
            _GLANCE,
            at_a_glance([line for line in lines if line["sensor_forward_m"] == 0.0]),
            "## Collisions\n",
            collisions_in_all(lines),
            "## Success / collision / timeout in %\n",
            *tables,
        )
    )


def _limits(lines: Sequence[Line]) -> str:
    searched = [line for line in lines if line["policy"] == SOUND_LIMIT]
    if not searched:
        return ""
    sound = [policy for policy in policies_of(lines) if _is_sound(lines, policy)]
    show = reached(lines)
    details = full([line for line in lines if line["policy"] in LIMITS], _cell, "cell")
    return "\n".join(
        (
            _LIMITS.format(episodes=max(line["episodes"] for line in searched)),
            by_map(lines, SOUND_LIMIT, limits_of, "clairvoyant / sound limit"),
            folded("The ways found by the searches alone, with intervals", details),
            _REACHED.format(success=100 * SUCCESS_WANTED, speed=100 * SPEED_WANTED),
            cells_reached(lines, sound),
            *(by_map(lines, policy, show, f"`{policy}`") for policy in sound),
            _TIMEOUTS,
            timeouts(lines),
        )
    )


def _is_sound(lines: Sequence[Line], policy: str) -> bool:
    return any(line["sound"] for line in lines if line["policy"] == policy)


def _cell(line: Line) -> str:
    return f"{line['map']}, {where(line)}"


def _smooth(lines: Sequence[Line]) -> str:
    own = [
        line
        for line in lines
        if line["scenario"] == BASE
        and line["sensor_forward_m"] == 0.0
        and line["policy"] not in LIMITS
    ]
    if not own:
        return ""
    note = "A hard brake takes more than 1 m/s off in one decision. Base, sensor at the centre.\n"
    return f"## Smoothness\n\n{note}\n{smoothness(own)}"


def _memory(lines: Sequence[Line], without: Sequence[Line]) -> str:
    if not lines:
        return ""
    rows = []
    for line in lines:
        before = next(
            (
                each
                for each in without
                if _cell(each) == _cell(line) and each["policy"] == line["policy"]
            ),
            None,
        )
        success = (None if each is None else each["success"] for each in (before, line))
        rows.append(
            [
                _cell(line),
                line["policy"],
                *(with_interval(each, 100.0) for each in success),
                outcome(line),
            ]
        )
    header = ["cell", "policy", "instantaneous, %", "tracked, %", "tracked: S / C / T"]
    return f"{_MEMORY}\n{table(header, rows)}"


def _frontier(lines: Sequence[Line], links: Sequence[str]) -> str:
    if not lines:
        return ""
    parts = [_FRONTIER.format(map=lines[0]["map"])]
    parts += [f"![Collisions against success and crossing time]({link})\n" for link in links]
    for traffic, own in by_traffic(lines).items():
        parts.append(f"### {traffic}\n")
        parts.append(full(own, top_speed, "cap, m/s"))
    return "\n".join(parts)


def _violated(lines: Sequence[Line]) -> str:
    if not lines:
        return ""
    return f"{_VIOLATED}\n{full(lines, _broken, 'scenario')}"


def _granted(lines: Sequence[Line]) -> str:
    if not lines:
        return ""
    return "\n".join((_GRANTED, collisions_in_all(lines), full(lines, _broken, "scenario")))


def _broken(line: Line) -> str:
    return f"{line['map']}, {line['scenario'].replace('_', ' ')}"


def _versions(versions: dict[str, Any]) -> str:
    missing = versions.get("missing", [])
    note = f"\nNot in this version: {', '.join(missing)}.\n" if missing else ""
    return versions_table(versions) + note
