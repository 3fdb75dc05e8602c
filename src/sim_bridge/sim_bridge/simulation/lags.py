# SPDX-License-Identifier: Apache-2.0
"""What takes time between a decision and its effect, and between seeing and braking."""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Booleans, Integers
from sim_bridge.simulation.settings import NEVER, Reaction
from sim_bridge.simulation.state import NO_ACTION, Episodes

UNNOTICED = -1


class Lags(NamedTuple):
    """All that changes beside the state, in scenarios whose egos or drivers are slow to react.

    given (B, D): the last D actions of each ego, which take effect D inner steps after they were
    given; that of inner step t is at place t modulo D. in_force (B,): the action carried out.
    noticed (B, N): for how many inner steps each driver has known of an ego in its way, -1 for
    not at all. D and N are 0 where there is no such lag.
    """

    given: Integers
    in_force: Integers
    noticed: Integers


def empty_lags(batch: int, vehicles: int, delay_steps: int, reaction: Reaction) -> Lags:
    """Return the lags of a batch before anything was decided or seen."""
    drivers = vehicles if reaction.after_steps != NEVER else 0
    return Lags(
        given=np.full((batch, delay_steps), NO_ACTION, dtype=np.int64),
        in_force=np.full(batch, NO_ACTION, dtype=np.int64),
        noticed=np.full((batch, drivers), UNNOTICED, dtype=np.int64),
    )


def forget_lags(lags: Lags, mask: Booleans) -> None:
    """Begin anew where a mask (B,) says so."""
    lags.given[mask] = NO_ACTION
    lags.in_force[mask] = NO_ACTION
    lags.noticed[mask] = UNNOTICED


@kernel
def take_effect(lags: Lags, episodes: Episodes, actions: Integers) -> None:
    """Put in force what was given D inner steps ago, and keep the actions (B,) given now."""
    steps = lags.given.shape[1]
    running, tick = episodes.running, episodes.tick
    given, in_force = lags.given, lags.in_force
    for b in range(len(actions)):
        if steps == 0:
            in_force[b] = actions[b]
        elif running[b]:
            place = tick[b] % steps
            in_force[b] = given[b, place]
            given[b, place] = actions[b]
