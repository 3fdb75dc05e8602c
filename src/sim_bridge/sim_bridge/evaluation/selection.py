# SPDX-License-Identifier: Apache-2.0
"""Picks lines of results.json, and averages policies that differ in their training seed only."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple

from sim_bridge.evaluation.cells import BASE, RESPAWNING

Line = dict[str, Any]


class Spread(NamedTuple):
    """Mean over training seeds with the interval: of the one seed, or lowest and highest seed."""

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


def spread(lines: Sequence[Line], read: Callable[[Line], Line | None]) -> Spread | None:
    """Average what `read` finds in each line (rate or mean, low, high); None without any."""
    found = [value for value in map(read, lines) if value is not None]
    if not found:
        return None
    centers = [float(value["rate"] if "rate" in value else value["mean"]) for value in found]
    mean = sum(centers) / len(centers)
    if len(found) == 1:
        return Spread(mean, found[0]["low"], found[0]["high"], 1)
    return Spread(mean, min(centers), max(centers), len(found))


def actions_normalised(lines: Sequence[Line], reference: Sequence[Line]) -> dict[str, float]:
    """Return the number of actions of each kind over that of the reference (paper, figure 7).

    An action that the reference never takes is left out: there is nothing to divide by.
    """
    result = {}
    for action in ("fast", "slow", "stop"):
        counts, ours = (
            [line["actions_per_episode"][action]["mean"] for line in group]
            for group in (reference, lines)
        )
        if counts and ours and sum(counts) > 0.0:
            result[action] = (sum(ours) / len(ours)) / (sum(counts) / len(counts))
    return result
