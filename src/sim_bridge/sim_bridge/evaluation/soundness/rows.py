# SPDX-License-Identifier: Apache-2.0
"""Copies of episodes from one simulation into another, so that one moment is followed by several.

The state of a simulation is arrays with the batch as first dimension; so is that of its memory,
but for the sets of its paths, which are B * P rows.
"""

from collections.abc import Iterator
from typing import Any

from numpy.typing import NDArray

from risk_dqn_planner.situation.situations import Integers
from sim_bridge.simulation.simulation import Simulation
from sim_bridge.simulation.state import SimulationState


def _arrays(state: tuple[Any, ...]) -> Iterator[NDArray[Any]]:
    for part in state:
        if isinstance(part, tuple):
            yield from _arrays(part)
        else:
            yield part


def copy_rows(source: SimulationState, rows: Integers, target: SimulationState) -> None:
    """Copy episodes `rows` (K,) of one state to the first K places of another; the rest ends."""
    count = len(rows)
    for old, new in zip(_arrays(source), _arrays(target), strict=True):
        new[:count] = old[rows]
    target.episodes.running[count:] = False


def keep_memory(simulation: Simulation, rows: Integers) -> None:
    """Let the memory of hidden places go on with episodes `rows` (B,) in place of the present."""
    space = simulation.hidden_space
    if space is None:
        return
    batch = simulation.batch
    for array in space:
        # A view, so that the memory itself changes: its kernels hold on to these arrays.
        own = array.reshape(batch, -1)
        own[:] = own[rows]
