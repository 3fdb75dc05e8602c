# SPDX-License-Identifier: Apache-2.0
"""The shortest way to the goal through traffic that is known and does not react (kernels).

A* over the ego's exact states (decision step, position, speed). Time is the cost and part of the
state, so a state met a second time is no better than the first. The bound on the rest is the time
of driving Fast on an empty road, or that of bounds.py where the traffic makes it too weak; no way
can undercut either, so the first goal that comes off the queue is an optimum, to the inner step.
There is no other pruning: of two states at one time neither the further nor the faster one can
always do what the other can.
"""

import math

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.decision import Action
from risk_dqn_planner.geometry.footprint import footprints_overlap
from risk_dqn_planner.risk.motion import time_to_cover
from risk_dqn_planner.situation.situations import Integers
from sim_bridge.evaluation.bounds import CELL_M, Bounds, Rules, Speeds
from sim_bridge.evaluation.found import NOTHING, enlarged, find, rehashed, room_for, trace
from sim_bridge.simulation.dynamics import follow_target, target_speed
from sim_bridge.simulation.settings import EgoDrive
from sim_bridge.simulation.state import Vehicles
from sim_bridge.world.path_geometry import table_pose
from sim_bridge.world.world import EgoLane, Paths

IMPOSSIBLE = -1
GAVE_UP = -2

_ACTIONS = len(Action)
_FIRST_ROOM = 1 << 14
# Times are compared in inner steps; rounding must not make the bound one step too long.
_ROUNDING = 1e-6


@kernel
def collides(ego: EgoLane, paths: Paths, traffic: Vehicles, step: int, ego_s: float) -> bool:
    """Tell whether the ego at ego_s overlaps a vehicle after an inner step, row of (T, N)."""
    x, y, heading = table_pose(ego.table, 0, ego_s)
    for i in range(traffic.driving.shape[1]):
        p, s_m = traffic.path[step, i], traffic.s_m[step, i]
        if not traffic.driving[step, i]:
            continue
        if s_m < paths.contact_low_m[p] or s_m > paths.contact_high_m[p]:
            continue
        other_x, other_y, other_heading = table_pose(paths.table, p, s_m)
        if footprints_overlap(
            x, y, heading, ego.length_m, ego.width_m,
            other_x, other_y, other_heading, paths.vehicle_length_m, paths.vehicle_width_m,
        ):  # fmt: skip
            return True
    return False


@kernel
def advance_ego(
    ego: EgoLane,
    paths: Paths,
    drive: EgoDrive,
    rules: Rules,
    traffic: Vehicles,
    s_m: float,
    speed_mps: float,
    tick: int,
    action: int,
) -> tuple[bool, float, float, int]:
    """Return (survived, s, speed, tick) after an action, as the simulation carries it out.

    It ends early at the goal. Not to survive is to collide, or to be late.
    """
    target = target_speed(action, drive.slow_mps, drive.fast_mps)
    for _ in range(rules.decision_steps):
        way, speed_mps = follow_target(
            speed_mps, target, rules.step_s, drive.acceleration_mps2, drive.braking_mps2
        )
        s_m += way
        near = ego.contact_low_m <= s_m <= ego.contact_high_m
        # Row k holds the traffic after k + 1 inner steps.
        if near and collides(ego, paths, traffic, tick, s_m):
            return False, s_m, speed_mps, tick
        tick += 1
        if s_m >= rules.goal_m:
            return True, s_m, speed_mps, tick
        if tick >= rules.limit_steps:
            return False, s_m, speed_mps, tick
    return True, s_m, speed_mps, tick


@kernel
def earliest_tick(
    drive: EgoDrive,
    rules: Rules,
    bounds: Bounds,
    s_m: float,
    speed_mps: float,
    speed: int,
    tick: int,
) -> int:
    """Return a lower bound of the inner step of arrival; the tick itself at the goal."""
    rest_s = time_to_cover(rules.goal_m - s_m, speed_mps, drive.acceleration_mps2, drive.fast_mps)
    earliest = tick + int(math.ceil(rest_s / rules.step_s - _ROUNDING))  # noqa: RUF046 (numba)
    decision = tick // rules.decision_steps
    if s_m < rules.goal_m and decision < len(bounds.least):
        cell = int((s_m - bounds.start_m) / CELL_M)
        earliest = max(earliest, int(bounds.least[decision, speed, cell]))
    return earliest


@allocating_kernel
def fastest_way(
    ego: EgoLane,
    paths: Paths,
    drive: EgoDrive,
    rules: Rules,
    speeds: Speeds,
    bounds: Bounds,
    traffic: Vehicles,
    start_m: float,
    latest: int,
    merge_m: float,
    most_states: int,
    actions: Integers,
) -> int:
    """Return the inner steps to the goal, IMPOSSIBLE by `latest`, or GAVE_UP at `most_states`.

    traffic: a row for each inner step (T, N) in place of the batch. States closer than `merge_m`
    with equal speed at the same time are one. actions (T / decision_steps,): filled with the way.
    """
    nodes = room_for(_FIRST_ROOM)
    table = np.full(4 * _FIRST_ROOM, NOTHING, dtype=np.int64)
    queue = np.full(latest + 1, NOTHING, dtype=np.int64)
    nodes.s_m[0], nodes.speed_mps[0], nodes.speed[0], nodes.tick[0] = start_m, speeds.mps[0], 0, 0
    nodes.parent[0], nodes.action[0], nodes.next[0] = NOTHING, 0, NOTHING
    table[find(table, nodes, start_m, 0, 0, merge_m)] = 0
    used = 1
    bound = earliest_tick(drive, rules, bounds, start_m, speeds.mps[0], 0, 0)
    queue[min(bound, latest)] = 0
    while bound <= latest:
        k = queue[bound]
        if k == NOTHING:
            bound += 1
            continue
        queue[bound] = nodes.next[k]
        if nodes.s_m[k] >= rules.goal_m:
            trace(nodes, k, actions)
            return int(nodes.tick[k])
        if used + _ACTIONS > most_states:
            return GAVE_UP
        if used + _ACTIONS > len(nodes.s_m):
            nodes = enlarged(nodes, used)
            table = rehashed(nodes, used, 4 * len(nodes.s_m), merge_m)
        # The last one in is the first one out: of equally good ways the faster one is tried first.
        for action in range(_ACTIONS):
            survived, s_m, speed_mps, tick = advance_ego(
                ego, paths, drive, rules, traffic, nodes.s_m[k], nodes.speed_mps[k],
                nodes.tick[k], action,
            )  # fmt: skip
            if not survived:
                continue
            speed = speeds.after[nodes.speed[k], action]
            then = max(earliest_tick(drive, rules, bounds, s_m, speed_mps, speed, tick), bound)
            place = find(table, nodes, s_m, speed, tick, merge_m)
            if then <= latest and table[place] == NOTHING:
                table[place] = used
                nodes.s_m[used], nodes.speed_mps[used], nodes.speed[used] = s_m, speed_mps, speed
                nodes.tick[used], nodes.parent[used], nodes.action[used] = tick, k, action
                nodes.next[used], queue[then] = queue[then], used
                used += 1
    return IMPOSSIBLE
