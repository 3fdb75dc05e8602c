# SPDX-License-Identifier: Apache-2.0
"""Other vehicles among themselves where their paths cross: who arrives first goes first.

Only so that they do not drive through each other; the ego is nobody they would wait for.
"""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Booleans, Floats
from risk_dqn_planner.vehicle import VehicleDimensions
from sim_bridge.contact import contact_intervals
from sim_bridge.settings import Idm
from sim_bridge.state import Episodes, Vehicles

# Vehicles that could only stop by braking this much harder than is comfortable go on.
_EFFORT = 1.5
# A vehicle that waits, or is slow, is taken to come at this speed.
_SETTING_OFF_MPS = 3.0
# Places to cross that are further ahead are decided later.
_AHEAD_S = 6.0
_MARGIN_S = 0.5


class Crossings(NamedTuple):
    """Where path p crosses path q, row p and column q of (P, P): from enter_m to exit_m on p.

    Infinity where it does not. exist: whether any do.
    """

    enter_m: Floats
    exit_m: Floats
    exist: bool


def crossings(tables: Floats, shared: Booleans, vehicle: VehicleDimensions) -> Crossings:
    """Find where footprints on pairs of paths (P, K, 3) touch, but for pairs that share a lane."""
    count = len(tables)
    enter_m, exit_m = np.full((count, count), np.inf), np.full((count, count), np.inf)
    for p in range(count):
        for q in range(count):
            if p != q and not shared[p, q]:
                (enter_m[p, q], exit_m[p, q]), _ = contact_intervals(
                    tables[p], tables[q : q + 1], vehicle, vehicle
                )
    return Crossings(enter_m, exit_m, bool((enter_m < np.inf).any()))


@kernel
def goes_first(
    way_m: float, speed_mps: float, other_way_m: float, other_mps: float, idm: Idm
) -> bool:
    """Tell who of two vehicles before a crossing goes first; neither is in it yet.

    One that cannot stop any more, else the one that arrives first.
    """
    braking = 2.0 * _EFFORT * idm.comfortable_mps2
    must = speed_mps * speed_mps > braking * way_m
    other_must = other_mps * other_mps > braking * other_way_m
    if must != other_must:
        return must
    arrival = way_m / max(speed_mps, _SETTING_OFF_MPS)
    return arrival < other_way_m / max(other_mps, _SETTING_OFF_MPS)


@kernel
def give_way(crossings: Crossings, idm: Idm, episodes: Episodes, vehicles: Vehicles) -> None:
    """Where a decision is due, set before which arc length each vehicle waits for others."""
    running, phase = episodes.running, episodes.phase
    driving, path, s_m, speed_mps, hold_m = (
        vehicles.driving,
        vehicles.path,
        vehicles.s_m,
        vehicles.speed_mps,
        vehicles.hold_m,
    )
    enter_m, exit_m = crossings.enter_m, crossings.exit_m
    batch, count = driving.shape
    for b in range(batch):
        if not running[b] or phase[b] != 0:
            continue
        for i in range(count):
            p, v = path[b, i], speed_mps[b, i]
            hold_m[b, i] = math.inf
            for j in range(count):
                q, u = path[b, j], speed_mps[b, j]
                way_m = enter_m[p, q] - s_m[b, i]
                left_m = exit_m[q, p] - s_m[b, j]
                arrival_s = way_m / max(v, _SETTING_OFF_MPS)
                near = (way_m > 0.0) & (arrival_s < _AHEAD_S) & (left_m > 0.0)
                if not (near & driving[b, i] & driving[b, j]):
                    continue
                other_way_m = enter_m[q, p] - s_m[b, j]
                if other_way_m > 0.0:
                    gone_s = left_m / max(u, _SETTING_OFF_MPS) + _MARGIN_S
                    first = goes_first(way_m, v, other_way_m, u, idm)
                    tie = (not first) & (not goes_first(other_way_m, u, way_m, v, idm)) & (i < j)
                    if first or tie or gone_s < arrival_s:
                        continue
                hold_m[b, i] = min(hold_m[b, i], enter_m[p, q])
