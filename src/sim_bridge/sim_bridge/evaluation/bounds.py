# SPDX-License-Identifier: Apache-2.0
"""A lower bound on the time to the goal that knows the traffic (kernels), for search.py.

From the last decision back to the first, for every speed that the ego can have and every cell of
its path: the earliest arrival from anywhere in the cell, where each action may end in the best of
the cells it touches and only what the whole cell runs into counts as a collision. So it never
exceeds the true optimum, and is above it by what cells of 3 mm give away.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.decision import Action
from risk_dqn_planner.geometry.footprint import footprints_overlap
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers
from sim_bridge.simulation.dynamics import follow_target, target_speed
from sim_bridge.simulation.settings import EgoDrive
from sim_bridge.simulation.state import Vehicles
from sim_bridge.world.path_geometry import table_pose
from sim_bridge.world.world import EgoLane, Paths

# With the default limits every way of a decision is a whole number of these.
CELL_M = 1.0 / 336.0
NEVER = np.int16(32767)

_ACTIONS = len(Action)
_SAME_MPS = 1e-7
_MOST_SPEEDS = 4096
_ROUNDING = 1e-6


class Rules(NamedTuple):
    """What an episode's clock and goal are: times in inner steps of step_s."""

    step_s: float
    decision_steps: int
    limit_steps: int
    goal_m: float


class Speeds(NamedTuple):
    """The S speeds that the ego can have at a decision.

    mps (S,). after (S, 3): index of the speed that an action leads to. way_m (S, 3, J): how far
    the ego has come after each of the J inner steps of the action.
    """

    mps: Floats
    after: Integers
    way_m: Floats


class Bounds(NamedTuple):
    """least (D, S, C): earliest inner step of arrival, NEVER if there is none up to decision D.

    Cell c begins at start_m + c CELL_M. D is 0 where there is no bound.
    """

    least: NDArray[np.int16]
    start_m: float


@allocating_kernel
def speeds_from(drive: EgoDrive, rules: Rules, start_mps: float) -> Speeds:
    """Return all speeds that any actions lead to; the start speed has index 0.

    They are few: target speeds, and what lies whole steps of acceleration and braking apart.
    """
    mps = np.empty(_MOST_SPEEDS)
    after = np.zeros((_MOST_SPEEDS, _ACTIONS), dtype=np.int64)
    way_m = np.zeros((_MOST_SPEEDS, _ACTIONS, rules.decision_steps))
    mps[0] = start_mps
    count, done = 1, 0
    while done < count:
        for action in range(_ACTIONS):
            speed, s_m = mps[done], 0.0
            target = target_speed(action, drive.slow_mps, drive.fast_mps)
            for j in range(rules.decision_steps):
                way, speed = follow_target(
                    speed, target, rules.step_s, drive.acceleration_mps2, drive.braking_mps2
                )
                s_m += way
                way_m[done, action, j] = s_m
            known = 0
            while known < count and abs(mps[known] - speed) > _SAME_MPS:
                known += 1
            if known == count and count < _MOST_SPEEDS:
                mps[count] = speed
                count += 1
            after[done, action] = min(known, count - 1)
        done += 1
    return Speeds(mps[:count].copy(), after[:count].copy(), way_m[:count].copy())


@allocating_kernel
def no_bounds() -> Bounds:
    """Return bounds that hold nothing."""
    return Bounds(np.empty((0, 1, 1), dtype=np.int16), 0.0)


@allocating_kernel
def blocked_cells(
    ego: EgoLane,
    paths: Paths,
    traffic: Vehicles,
    start_m: float,
    first: int,
    last: int,
    steps: int,
) -> Booleans:
    """Return (T, last - first): whether the ego collides wherever it is in a cell.

    Footprints shrunk by a cell's size on every side, at the cell's centre: in a curve of 6 m
    radius no corner moves that far within half a cell.
    """
    result = np.zeros((steps, last - first), dtype=np.bool_)
    shrink = 2.0 * CELL_M
    poses = np.empty((last - first, 3))
    for c in range(last - first):
        pose = table_pose(ego.table, 0, start_m + (first + c + 0.5) * CELL_M)
        poses[c, 0], poses[c, 1], poses[c, 2] = pose
    for step in range(steps):
        for i in range(traffic.driving.shape[1]):
            p, s_m = traffic.path[step, i], traffic.s_m[step, i]
            if not traffic.driving[step, i]:
                continue
            if s_m < paths.contact_low_m[p] or s_m > paths.contact_high_m[p]:
                continue
            x, y, heading = table_pose(paths.table, p, s_m)
            for c in range(last - first):
                if not result[step, c]:
                    result[step, c] = footprints_overlap(
                        poses[c, 0], poses[c, 1], poses[c, 2],
                        ego.length_m - shrink, ego.width_m - shrink,
                        x, y, heading, paths.vehicle_length_m, paths.vehicle_width_m,
                    )  # fmt: skip
    return result


@allocating_kernel
def lower_bounds(
    ego: EgoLane,
    paths: Paths,
    rules: Rules,
    speeds: Speeds,
    traffic: Vehicles,
    start_m: float,
    latest: int,
) -> Bounds:
    """Return the bounds for arrivals up to inner step `latest`.

    traffic: a row for each inner step (T, N), as in search.py.
    """
    # Ways that are whole numbers of cells lead from the middle of cells to the middle of cells.
    start_m -= 0.5 * CELL_M
    cells = int(math.ceil((rules.goal_m - start_m) / CELL_M)) + 1  # noqa: RUF046 (numba)
    first = min(max(int((ego.contact_low_m - start_m) / CELL_M) - 1, 0), cells)
    # The contact may have no end; beyond the goal nothing matters.
    last = int(min(ego.contact_high_m - start_m, cells * CELL_M) / CELL_M) + 1
    last = max(min(last, cells - 3), first)
    blocked = blocked_cells(ego, paths, traffic, start_m, first, last, latest)
    decisions = -(-latest // rules.decision_steps)
    least = np.full((decisions + 1, len(speeds.mps), cells), NEVER, dtype=np.int16)
    dead = np.zeros(cells, dtype=np.bool_)
    goal_m, top_mps = rules.goal_m - start_m, speeds.mps.max()
    for d in range(decisions - 1, -1, -1):
        tick = d * rules.decision_steps
        # Where the ego can be by then, and still be at the goal in time.
        rest_m = top_mps * rules.step_s * (latest - tick)
        begin = max(int((goal_m - rest_m) / CELL_M) - 1, 0)
        end = min(int(top_mps * rules.step_s * tick / CELL_M) + 3, cells)
        for v in range(len(speeds.mps)):
            for action in range(_ACTIONS):
                then = least[d + 1, speeds.after[v, action]]
                way_m = speeds.way_m[v, action]
                mark_collisions(way_m, blocked, first, tick, dead)
                relax(way_m[-1], then, dead, begin, end, least[d, v])
                arrive(way_m, goal_m, tick, latest, dead, end, least[d, v])
    return Bounds(least, start_m)


@kernel
def whole_cells(way_m: float) -> tuple[int, int]:
    """Return how many cells a way leads on, at least and at most."""
    moved = way_m / CELL_M
    low = int(moved + _ROUNDING)
    return low, low + (moved > low + _ROUNDING)


@kernel
def mark_collisions(
    way_m: Floats, blocked: Booleans, first: int, tick: int, dead: Booleans
) -> None:
    """Mark the cells (C,) from which a motion (J,) collides whatever the place in the cell.

    blocked (T, K): of the cells from `first` on.
    """
    dead[:] = False
    for j in range(min(len(way_m), len(blocked) - tick)):
        low, high = whole_cells(way_m[j])
        row = blocked[tick + j]
        for k in range(len(row)):
            c, other = first + k - low, k + high - low
            if c >= 0 and other < len(row) and row[k] and row[other]:
                dead[c] = True


@kernel
def relax(
    way_m: float,
    then: NDArray[np.int16],
    dead: Booleans,
    begin: int,
    end: int,
    least: NDArray[np.int16],
) -> None:
    """Lower `least` (C,) from begin to end to the bounds `then` (C,) of where a motion leads."""
    low, high = whole_cells(way_m)
    for c in range(begin, min(end, len(least) - high)):
        best = min(then[c + low], then[c + high])
        # Written as a choice, not a branch, so that it runs in vector registers.
        least[c] = least[c] if dead[c] else min(least[c], best)


@kernel
def arrive(
    way_m: Floats,
    goal_m: float,
    tick: int,
    latest: int,
    dead: Booleans,
    end: int,
    least: NDArray[np.int16],
) -> None:
    """Lower `least` (C,) up to `end` where a motion (J,) reaches the goal, at `goal_m`."""
    for j in range(len(way_m) - 1, -1, -1):
        begin = max(int((goal_m - way_m[j]) / CELL_M) - 1, 0)
        if tick + j + 1 > latest:
            continue
        for c in range(begin, end):
            if not dead[c]:
                least[c] = min(least[c], np.int16(tick + j + 1))
