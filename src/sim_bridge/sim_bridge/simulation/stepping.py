# SPDX-License-Identifier: Apache-2.0
"""The simulation's step: every kernel takes all episodes of a batch one inner step further.

An episode that has ended stays as it is.
"""

import math

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.decision import Action
from risk_dqn_planner.geometry.footprint import footprints_overlap
from risk_dqn_planner.situation.situations import Floats, Integers
from sim_bridge.simulation.dynamics import accelerate, follow_target, target_speed
from sim_bridge.simulation.lags import Lags, take_effect
from sim_bridge.simulation.population import let_one_in, replace_those_gone
from sim_bridge.simulation.reacting import brake_for_egos
from sim_bridge.simulation.right_of_way import Crossings, give_way
from sim_bridge.simulation.settings import Reaction, Settings
from sim_bridge.simulation.state import NO_ACTION, Counts, Episodes, SimulationState, Vehicles
from sim_bridge.simulation.traffic import (
    find_leaders,
    follow_egos,
    follow_leaders,
    wait_for_others,
    yield_to_egos,
)
from sim_bridge.world.path_geometry import table_pose
from sim_bridge.world.sharing import EgoSharing, Sharing
from sim_bridge.world.world import EgoLane, Lanes, Paths

# A decision step that takes more than this off the ego's speed counts as hard braking.
_HARD_BRAKE_MPS = 1.0
_STANDING_MPS = 0.1
_ACTIONS = len(Action)


@kernel
def are_actions(values: Integers) -> bool:
    """Tell whether values (B,) are actions, all of them."""
    wrong = 0
    for value in values:
        wrong += (value < 0) | (value >= _ACTIONS)
    return wrong == 0


@kernel
def advance(
    ego: EgoLane,
    paths: Paths,
    lanes: Lanes,
    sharing: Sharing,
    crossings: Crossings,
    ego_sharing: EgoSharing,
    corners: Floats,
    settings: Settings,
    state: SimulationState,
    lagging: tuple[Reaction, Lags] | None,
    actions: Integers,
    shadows: Floats,
    steps: int,
) -> None:
    """Take all running episodes `steps` inner steps further under their actions (B,).

    corners (2, K, 4, 2): catalogue of the obstacles; lagging: None where neither actions take
    effect later nor others brake for the ego, which then costs nothing; shadows (B, O, 4, 3):
    memory to work in.
    """
    episodes, vehicles, counts = state.episodes, state.vehicles, state.counts
    idm, first_zone_m = settings.idm, ego.first_zone_m
    lengths_m = 0.5 * (ego.length_m + paths.vehicle_length_m)
    for _ in range(steps):
        replace_those_gone(paths, lanes, settings.draws, episodes, vehicles)
        let_one_in(ego, paths, sharing, corners, settings, episodes, vehicles, shadows)
        find_leaders(sharing, episodes, vehicles)
        if crossings.exist:
            give_way(crossings, idm, episodes, vehicles)
        count_decisions(episodes, counts, actions)
        follow_leaders(paths.vehicle_length_m, idm, episodes, vehicles)
        follow_egos(lengths_m, first_zone_m, ego_sharing, idm, episodes, vehicles)
        if crossings.exist:
            wait_for_others(idm, episodes, vehicles)
        if settings.draws.yielding_share > 0.0:
            yield_to_egos(paths, lanes, idm, episodes, vehicles)
        if lagging is not None:
            brake_for_egos(ego, paths, lanes, corners, settings, lagging, state, shadows)
        move_vehicles(
            paths.exit_m, paths.lane, settings.step_s, episodes, vehicles, counts.last_left_s
        )
        if lagging is not None:
            take_effect(lagging[1], episodes, actions)
            move_egos(settings, episodes, lagging[1].in_force)
        else:
            move_egos(settings, episodes, actions)
        note_time_gaps(first_zone_m, lanes, paths, settings.step_s, state)
        detect_collisions(ego, paths, episodes, vehicles)
        conclude(ego.goal_m, settings.limit_steps, episodes, counts)


@kernel
def count_decisions(episodes: Episodes, counts: Counts, actions: Integers) -> None:
    """Count actions (B,) and their changes where a decision is due."""
    running, phase, speed_mps = episodes.running, episodes.phase, episodes.ego_speed_mps
    action_counts, changes, last = counts.action_counts, counts.action_changes, counts.last_action
    speed_at_decision_mps = counts.speed_at_decision_mps
    for b in range(len(actions)):
        if not running[b] or phase[b] != 0:
            continue
        action = actions[b]
        action_counts[b, action] += 1
        changes[b] += last[b] not in (NO_ACTION, action)
        last[b] = action
        speed_at_decision_mps[b] = speed_mps[b]


@kernel
def move_vehicles(
    exit_m: Floats,
    lane: Integers,
    step_s: float,
    episodes: Episodes,
    vehicles: Vehicles,
    last_left_s: Floats,
) -> None:
    """Move all other vehicles under their accelerations, noting who leaves a conflict zone.

    exit_m, lane (P,): end of the zone on each path, and its lane; last_left_s (B, M) of Counts.
    """
    running, tick = episodes.running, episodes.tick
    driving, path, s_m, speed_mps, acceleration_mps2 = (
        vehicles.driving,
        vehicles.path,
        vehicles.s_m,
        vehicles.speed_mps,
        vehicles.acceleration_mps2,
    )
    batch, count = driving.shape
    for b in range(batch):
        if not running[b]:
            continue
        for i in range(count):
            if not driving[b, i]:
                continue
            before = s_m[b, i]
            way, speed_mps[b, i] = accelerate(speed_mps[b, i], acceleration_mps2[b, i], step_s)
            after = before + way
            s_m[b, i] = after
            p = path[b, i]
            if before <= exit_m[p] < after:
                last_left_s[b, lane[p]] = (tick[b] + 1) * step_s


@kernel
def move_egos(settings: Settings, episodes: Episodes, actions: Integers) -> None:
    """Let every ego carry out its action (B,), or keep its speed without one; let time pass."""
    running, tick, phase = episodes.running, episodes.tick, episodes.phase
    s_m, step_m, speed_mps = episodes.ego_s_m, episodes.ego_step_m, episodes.ego_speed_mps
    ego, decision_steps = settings.ego, settings.decision_steps
    for b in range(len(actions)):
        if not running[b]:
            continue
        tick[b] += 1
        phase[b] = phase[b] + 1 if phase[b] + 1 < decision_steps else 0
        target_mps = target_speed(actions[b], ego.slow_mps, ego.fast_mps)
        if actions[b] == NO_ACTION:
            target_mps = speed_mps[b]
        step_m[b], speed_mps[b] = follow_target(
            speed_mps[b],
            target_mps,
            settings.step_s,
            ego.acceleration_mps2,
            ego.braking_mps2,
        )
        s_m[b] += step_m[b]


@kernel
def note_time_gaps(
    first_zone_m: float, lanes: Lanes, paths: Paths, step_s: float, state: SimulationState
) -> None:
    """Note time gaps where an ego has just entered or left a conflict zone."""
    running, tick = state.episodes.running, state.episodes.tick
    s_m, step_m = state.episodes.ego_s_m, state.episodes.ego_step_m
    least_s, last_left_s = state.counts.least_time_gap_s, state.counts.last_left_s
    ego_zone_m, center_m = lanes.ego_zone_m, lanes.ego_zone_center_m
    for b in range(len(least_s)):
        after = s_m[b]
        if not running[b] or after <= first_zone_m:
            continue
        before = after - step_m[b]
        for lane in range(len(center_m)):
            half = 0.5 * ego_zone_m[lane]
            if before <= center_m[lane] - half < after:
                least_s[b] = min(least_s[b], tick[b] * step_s - last_left_s[b, lane])
            if before <= center_m[lane] + half < after:
                gap_s = time_to_next(lane, paths, state.vehicles, b)
                least_s[b] = min(least_s[b], gap_s)


@kernel
def time_to_next(lane: int, paths: Paths, vehicles: Vehicles, b: int) -> float:
    """Return when the next vehicle reaches a lane's zone at its present speed, or infinity."""
    next_s = math.inf
    for i in range(vehicles.driving.shape[1]):
        p = vehicles.path[b, i]
        way = paths.enter_m[p] - vehicles.s_m[b, i]
        if vehicles.driving[b, i] and paths.lane[p] == lane and way >= 0.0:
            next_s = min(next_s, way / max(vehicles.speed_mps[b, i], _STANDING_MPS))
    return next_s


@kernel
def detect_collisions(ego: EgoLane, paths: Paths, episodes: Episodes, vehicles: Vehicles) -> None:
    """Mark episodes in which the ego's footprint overlaps another one."""
    running, collided, ego_s_m = episodes.running, episodes.collided, episodes.ego_s_m
    driving, path, s_m = vehicles.driving, vehicles.path, vehicles.s_m
    low_m, high_m, ego_low_m, ego_high_m = (
        paths.contact_low_m,
        paths.contact_high_m,
        ego.contact_low_m,
        ego.contact_high_m,
    )
    ego_table, table = ego.table, paths.table
    length_m, width_m = ego.length_m, ego.width_m
    other_length_m, other_width_m = paths.vehicle_length_m, paths.vehicle_width_m
    batch, count = driving.shape
    for b in range(batch):
        if not running[b] or ego_s_m[b] < ego_low_m or ego_s_m[b] > ego_high_m:
            continue
        x, y, turn = table_pose(ego_table, 0, ego_s_m[b])
        for i in range(count):
            p, s = path[b, i], s_m[b, i]
            if driving[b, i] and low_m[p] <= s <= high_m[p]:
                px, py, other = table_pose(table, p, s)
                collided[b] |= footprints_overlap(
                    x, y, turn, length_m, width_m, px, py, other, other_length_m, other_width_m
                )


@kernel
def conclude(goal_m: float, limit_steps: int, episodes: Episodes, counts: Counts) -> None:
    """End episodes at a collision, the goal or the time limit, in this order."""
    running, collided, reached_goal, timed_out = (
        episodes.running,
        episodes.collided,
        episodes.reached_goal,
        episodes.timed_out,
    )
    tick, phase, s_m, speed_mps = (
        episodes.tick,
        episodes.phase,
        episodes.ego_s_m,
        episodes.ego_speed_mps,
    )
    speed_at_decision_mps, hard_brakes = counts.speed_at_decision_mps, counts.hard_brakes
    for b in range(len(running)):
        if not running[b]:
            continue
        reached_goal[b] = not collided[b] and s_m[b] >= goal_m
        timed_out[b] = not (collided[b] or reached_goal[b]) and tick[b] >= limit_steps
        running[b] = not (collided[b] or reached_goal[b] or timed_out[b])
        if not running[b] or phase[b] == 0:
            hard_brakes[b] += speed_at_decision_mps[b] - speed_mps[b] > _HARD_BRAKE_MPS
