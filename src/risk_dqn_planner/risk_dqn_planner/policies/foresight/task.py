# SPDX-License-Identifier: Apache-2.0
"""What one search is about, and the room that it needs."""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.policies.foresight.creeping import shortfalls
from risk_dqn_planner.safety.assumptions import SafetyNumbers
from risk_dqn_planner.safety.joint_check import ACTIONS
from risk_dqn_planner.safety.known import Known
from risk_dqn_planner.situation.situations import (
    Booleans,
    Floats,
    Integers,
    Situations,
    empty_situations,
)


class SearchNumbers(NamedTuple):
    """LookAheadConfig flattened to the numbers that kernels read."""

    decisions: int
    cell_m: float
    cell_mps: float
    switching_s: float
    gap_price: float
    chance_s: float = 0.0
    haste: float = 0.0
    creeping_s_per_m: float = 0.0
    fine: int = 1


class Task(NamedTuple):
    """A row of B situations to be searched; all ways are the ego's from now on.

    s, row, p, known: as in the joint check. c: of the search. corner_m (B, M): as in sight.py.
    sound (B, 3): the actions to choose from. in_force (B,): the action before.
    """

    s: Situations
    row: int
    p: SafetyNumbers
    c: SearchNumbers
    known: Known
    corner_m: Floats
    sound: Booleans
    in_force: Integers


class Node(NamedTuple):
    """A state at one decision of the horizon.

    way_m, speed_mps: of the ego. cost_s: price of the changes of action. first: the action that
    led here; last: the one in force.
    """

    way_m: float
    speed_mps: float
    cost_s: float
    first: int
    last: int


class Nodes(NamedTuple):
    """States at two decisions, one after the other, all (2, C), as in `Node`."""

    way_m: Floats
    speed_mps: Floats
    cost_s: Floats
    first: Integers
    last: Integers


class Places(NamedTuple):
    """Where the ego may wait, all (M,): `count` of them hold.

    rest_m: how far it is; clear_m: to the end of the zones behind, up to the next place. joins:
    it waits to join a lane.
    """

    rest_m: Floats
    clear_m: Floats
    joins: Booleans


class Cells(NamedTuple):
    """Cells of way and speed (C,): the decision that used them last, and the state in them."""

    stamp: Integers
    node: Integers


class Best(NamedTuple):
    """The best plan so far: its time and first action (1,).

    critical (2,): vehicle and lane that forbid to go at present, -1 nobody.
    """

    total_s: Floats
    action: Integers
    critical: Integers


class Work(NamedTuple):
    """Room for one search; to be had from `work_for`.

    ahead: row k is the situation predicted for decision k, seen from the state in hand.
    known: for these rows. arrival_s, who (M,): of anyone; of_vehicles_s, nearest (M,): of
    perceived vehicles.
    """

    ahead: Situations
    known: Known
    arrival_s: Floats
    who: Integers
    of_vehicles_s: Floats
    nearest: Integers
    places: Places
    shortfall_m: Floats
    nodes: Nodes
    cells: Cells
    best: Best


def work_for(c: SearchNumbers, p: SafetyNumbers, vehicles: int, lanes: int) -> Work:
    """Return room to search situations of N vehicles and M lanes."""
    furthest_m = c.decisions * p.period_s * p.fast_mps
    # Egos that are faster than Fast at first share the last cells. Fine cells reach less far.
    cells = (math.ceil(furthest_m / c.cell_m) + 1) * (int(p.fast_mps / c.cell_mps) + 2)
    cells *= c.fine * (ACTIONS if p.delay_s > 0.0 else 1)
    return Work(
        ahead=empty_situations(c.decisions, vehicles, lanes),
        known=Known(
            np.empty((c.decisions, lanes)), *(np.empty((c.decisions, vehicles)) for _ in range(3))
        ),
        arrival_s=np.empty(lanes),
        who=np.empty(lanes, dtype=np.int64),
        of_vehicles_s=np.empty(lanes),
        nearest=np.empty(lanes, dtype=np.int64),
        places=Places(np.empty(lanes), np.empty(lanes), np.empty(lanes, dtype=np.bool_)),
        shortfall_m=shortfalls(p),
        nodes=Nodes(
            way_m=np.empty((2, cells)),
            speed_mps=np.empty((2, cells)),
            cost_s=np.empty((2, cells)),
            first=np.empty((2, cells), dtype=np.int64),
            last=np.empty((2, cells), dtype=np.int64),
        ),
        cells=Cells(np.empty(cells, dtype=np.int64), np.empty(cells, dtype=np.int64)),
        best=Best(np.empty(1), np.empty(1, dtype=np.int64), np.empty(2, dtype=np.int64)),
    )


def work_fit_for(w: Work, c: SearchNumbers, p: SafetyNumbers, situations: Situations) -> Work:
    """Return `w`, or new room if it is not of the situations' shape."""
    vehicles, lanes = situations.vehicle_mask.shape[1], situations.lane_mask.shape[1]
    if (vehicles, lanes) == (w.ahead.vehicle_mask.shape[1], w.ahead.lane_mask.shape[1]):
        return w
    return work_for(c, p, vehicles, lanes)
