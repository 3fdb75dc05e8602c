# SPDX-License-Identifier: Apache-2.0
"""Other vehicles among themselves where their paths cross: who arrives first goes first.

Only so that they do not drive through each other; the ego is nobody they would wait for.
"""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.situation.situations import Booleans, Floats
from risk_dqn_planner.vehicle import VehicleDimensions
from sim_bridge.simulation.settings import Idm
from sim_bridge.simulation.state import Episodes, Vehicles
from sim_bridge.world.contact import contact_intervals

# Vehicles that could only stop by braking this much harder than is comfortable go on.
_EFFORT = 1.5
# A vehicle that waits, or is slow, is taken to come at this speed.
_SETTING_OFF_MPS = 3.0
# Places to cross that are further ahead are decided later.
_AHEAD_S = 4.0
_MARGIN_S = 0.5


class Crossings(NamedTuple):
    """Where path p crosses path q, row p and column q of (P, P): from enter_m to exit_m on p.

    Infinity where it does not. begin_m, end_m (P,): all of these of a path lie between. exist:
    whether there are any.
    """

    enter_m: Floats
    exit_m: Floats
    begin_m: Floats
    end_m: Floats
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
    there = enter_m < np.inf
    return Crossings(
        enter_m=enter_m,
        exit_m=exit_m,
        begin_m=enter_m.min(axis=1),
        end_m=np.where(there, exit_m, -np.inf).max(axis=1),
        exist=bool(there.any()),
    )


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


@allocating_kernel
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
    begin_m, end_m = crossings.begin_m, crossings.end_m
    batch, count = driving.shape
    # Those in or shortly before any crossing.
    near = np.empty(count, dtype=np.int64)
    for b in range(batch):
        if not running[b] or phase[b] != 0:
            continue
        used = 0
        for i in range(count):
            hold_m[b, i] = math.inf
            p = path[b, i]
            ahead_m = _AHEAD_S * max(speed_mps[b, i], _SETTING_OFF_MPS)
            if driving[b, i] and begin_m[p] - ahead_m < s_m[b, i] < end_m[p]:
                near[used] = i
                used += 1
        for i in near[:used]:
            for j in near[:used]:
                p, q = path[b, i], path[b, j]
                if s_m[b, i] >= enter_m[p, q] or s_m[b, j] >= exit_m[q, p]:
                    continue
                if waits(
                    i,
                    enter_m[p, q] - s_m[b, i],
                    speed_mps[b, i],
                    j,
                    enter_m[q, p] - s_m[b, j],
                    exit_m[q, p] - s_m[b, j],
                    speed_mps[b, j],
                    idm,
                ):
                    hold_m[b, i] = min(hold_m[b, i], enter_m[p, q])


@kernel
def waits(
    i: int,
    way_m: float,
    mps: float,
    j: int,
    other_way_m: float,
    other_left_m: float,
    other_mps: float,
    idm: Idm,
) -> bool:
    """Tell whether vehicle i waits before a crossing for vehicle j, which has not left it yet.

    way_m: to the crossing; other_left_m: until the other one has left it.
    """
    if other_way_m <= 0.0:
        return True
    if other_way_m == math.inf:
        return False
    gone_s = other_left_m / max(other_mps, _SETTING_OFF_MPS) + _MARGIN_S
    if gone_s < way_m / max(mps, _SETTING_OFF_MPS):
        return False
    if goes_first(way_m, mps, other_way_m, other_mps, idm):
        return False
    return goes_first(other_way_m, other_mps, way_m, mps, idm) or j < i
