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


def _arrays(state: tuple[Any, ...]) -> Iterator[NDArray[Any]]:
    for part in state:
        if isinstance(part, tuple):
            yield from _arrays(part)
        else:
            yield part


def copy_rows(source: Simulation, rows: Integers, target: Simulation) -> None:
    """Copy episodes `rows` (K,) of one simulation to the first K of another; the rest ends."""
    count = len(rows)
    old_state, new_state = (source.state, source.lags), (target.state, target.lags)
    for old, new in zip(_arrays(old_state), _arrays(new_state), strict=True):
        new[:count] = old[rows]
    target.state.episodes.running[count:] = False


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
