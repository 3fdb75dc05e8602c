# SPDX-License-Identifier: Apache-2.0
"""The states that a search has found, and a hash table to find them again (kernels)."""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.situation.situations import Floats, Integers

NOTHING = -1


class Nodes(NamedTuple):
    """States found so far, all (K,).

    s_m, speed_mps: exact, as the simulation would have them; speed: index into `Speeds`.
    tick: inner steps done; parent: index of the state before, -1 at the start; action: what led
    here; next: next one in the same queue. A state at the goal has passed it at its tick.
    """

    s_m: Floats
    speed_mps: Floats
    speed: Integers
    tick: Integers
    parent: Integers
    action: Integers
    next: Integers


@allocating_kernel
def room_for(count: int) -> Nodes:
    """Return room for so many states."""
    return Nodes(
        np.empty(count),
        np.empty(count),
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.int64),
    )


@allocating_kernel
def enlarged(nodes: Nodes, used: int) -> Nodes:
    """Return room for twice as many states with the old ones in it."""
    larger = room_for(2 * len(nodes.s_m))
    larger.s_m[:used] = nodes.s_m[:used]
    larger.speed_mps[:used] = nodes.speed_mps[:used]
    larger.speed[:used] = nodes.speed[:used]
    larger.tick[:used] = nodes.tick[:used]
    larger.parent[:used] = nodes.parent[:used]
    larger.action[:used] = nodes.action[:used]
    larger.next[:used] = nodes.next[:used]
    return larger


@kernel
def place_of(s_m: float, speed: int, tick: int, merge_m: float, size: int) -> int:
    """Return where the search for a state in a hash table of a power of two begins."""
    mixed = (
        np.uint64(round(s_m / merge_m)) * np.uint64(0x9E3779B97F4A7C15)
        + np.uint64(speed) * np.uint64(0xBF58476D1CE4E5B9)
        + np.uint64(tick) * np.uint64(0x94D049BB133111EB)
    )
    mixed ^= mixed >> np.uint64(29)
    mixed *= np.uint64(0x9E3779B97F4A7C15)
    return int(np.int64((mixed >> np.uint64(20)) & np.uint64(size - 1)))


@kernel
def find(table: Integers, nodes: Nodes, s_m: float, speed: int, tick: int, merge_m: float) -> int:
    """Return where in the table a state is, or where it belongs if it is new."""
    size = len(table)
    place = place_of(s_m, speed, tick, merge_m, size)
    position = round(s_m / merge_m)
    while table[place] != NOTHING:
        k = table[place]
        if (
            nodes.tick[k] == tick
            and nodes.speed[k] == speed
            and round(nodes.s_m[k] / merge_m) == position
        ):
            return place
        place = (place + 1) & (size - 1)
    return place


@allocating_kernel
def rehashed(nodes: Nodes, used: int, size: int, merge_m: float) -> Integers:
    """Return a hash table of the states."""
    table = np.full(size, NOTHING, dtype=np.int64)
    for k in range(used):
        place = find(table, nodes, nodes.s_m[k], nodes.speed[k], nodes.tick[k], merge_m)
        table[place] = k
    return table


@kernel
def trace(nodes: Nodes, end: int, actions: Integers) -> None:
    """Fill in the actions (D,) that lead to a state; those behind it stay."""
    count = 0
    k = end
    while nodes.parent[k] != NOTHING:
        count += 1
        k = nodes.parent[k]
    k = end
    while nodes.parent[k] != NOTHING:
        count -= 1
        actions[count] = nodes.action[k]
        k = nodes.parent[k]
