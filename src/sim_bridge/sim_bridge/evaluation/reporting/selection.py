# SPDX-License-Identifier: Apache-2.0
"""Picks lines of results.json, and averages policies that differ in their training seed only."""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple

from sim_bridge.evaluation.cells import BASE, RESPAWNING

Line = dict[str, Any]


class Spread(NamedTuple):
    """Mean over training seeds, and what encloses the 95% intervals of all of them."""

    value: float
    low: float
    high: float
    seeds: int


def policies(lines: Iterable[Line]) -> list[str]:
    """Return the policies in their order of appearance."""
    return list(dict.fromkeys(line["policy"] for line in lines))


def cell_of(
    lines: Iterable[Line],
    policy: str,
    scenario: str = BASE,
    traffic: str = RESPAWNING,
    sensor_range_m: float | None = None,
) -> list[Line]:
    """Return a policy's lines in one cell, one for each training seed.

    sensor_range_m: None takes the first range that the scenario was evaluated with, its own.
    """
    found = [
        line
        for line in lines
        if (line["policy"], line["scenario"], line["traffic"]) == (policy, scenario, traffic)
    ]
    if found and sensor_range_m is None:
        sensor_range_m = found[0]["sensor_range_m"]
    chosen = [line for line in found if line["sensor_range_m"] == sensor_range_m]
    # A seed may be listed once only, whatever ranges coincide.
    return list({(line["policy_hash"], line["training_seed"]): line for line in chosen}.values())


def _read(key: str, line: Line) -> Line | None:
    value: Line | None = line[key]
    return value


def reader(key: str) -> Callable[[Line], Line | None]:
    """Return what reads the figures of one name from a line."""
    return partial(_read, key)


def center_of(value: Line) -> float:
    """Return the rate of a share, or the mean of whatever else was counted."""
    return float(value["rate"] if "rate" in value else value["mean"])


def spread(lines: Sequence[Line], read: Callable[[Line], Line | None]) -> Spread | None:
    """Average what `read` finds in each line (rate or mean, low, high); None without any."""
    found = [value for value in map(read, lines) if value is not None]
    if not found:
        return None
    centers = [center_of(value) for value in found]
    lows, highs = ([float(value[end]) for value in found] for end in ("low", "high"))
    return Spread(sum(centers) / len(centers), min(lows), max(highs), len(found))


def actions_normalised(lines: Sequence[Line], reference: Sequence[Line]) -> dict[str, Spread]:
    """Return the number of actions of each kind over that of the reference (paper, figure 7).

    An action that the reference never takes is left out: there is nothing to divide by. The
    intervals take both numbers for independent, which errs on the wide side.
    """
    result = {}
    for action in ("fast", "slow", "stop"):
        theirs, ours = (
            [line["actions_per_episode"][action] for line in group] for group in (reference, lines)
        )
        base = sum(value["mean"] for value in theirs)
        if not theirs or not ours or base <= 0.0:
            continue
        ratios = [value["mean"] * len(theirs) / base for value in ours]
        # The reference itself is 1 by definition.
        errors = [
            0.0 if ours == theirs else math.hypot(_relative(value), _relative(theirs[0]))
            for value in ours
        ]
        ends = [
            (ratio * max(1.0 - error, 0.0), ratio * (1.0 + error))
            for ratio, error in zip(ratios, errors, strict=True)
        ]
        result[action] = Spread(
            sum(ratios) / len(ratios),
            min(low for low, _ in ends),
            max(high for _, high in ends),
            len(ours),
        )
    return result


def _relative(value: Line) -> float:
    """Return half the interval of a mean, relative to it."""
    mean = float(value["mean"])
    return (float(value["high"]) - mean) / mean if mean > 0.0 else 0.0
