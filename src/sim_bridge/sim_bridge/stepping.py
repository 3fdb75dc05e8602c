# SPDX-License-Identifier: Apache-2.0
"""The simulation's step: every kernel takes all episodes of a batch one inner step further.

An episode that has ended stays as it is.
"""

import math

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.geometry.footprint import footprints_overlap
from risk_dqn_planner.situation.situations import Floats, Integers
from sim_bridge.dynamics import accelerate, follow_target, target_speed
from sim_bridge.path_geometry import table_pose
from sim_bridge.population import come_and_go
from sim_bridge.settings import Settings
from sim_bridge.sharing import EgoSharing, Sharing
from sim_bridge.state import NO_ACTION, Counts, Episodes, SimulationState, Vehicles
from sim_bridge.traffic import find_leaders, follow_egos, follow_leaders, yield_to_egos
from sim_bridge.world import EgoLane, Lanes, Paths

# A decision step that takes more than this off the ego's speed counts as hard braking.
_HARD_BRAKE_MPS = 1.0
_STANDING_MPS = 0.1


@kernel
def advance(
    ego: EgoLane,
    paths: Paths,
    lanes: Lanes,
    sharing: Sharing,
    ego_sharing: EgoSharing,
    settings: Settings,
    state: SimulationState,
    actions: Integers,
    steps: int,
) -> None:
    """Take all running episodes `steps` inner steps further under their actions (B,)."""
    episodes, vehicles, counts = state.episodes, state.vehicles, state.counts
    idm, first_zone_m = settings.idm, ego.first_zone_m
    lengths_m = 0.5 * (ego.length_m + paths.vehicle_length_m)
    for _ in range(steps):
        come_and_go(paths, lanes, sharing, settings, episodes, vehicles)
        find_leaders(sharing, episodes, vehicles)
        count_decisions(episodes, counts, actions)
        follow_leaders(paths.vehicle_length_m, idm, episodes, vehicles)
        follow_egos(lengths_m, first_zone_m, ego_sharing, idm, episodes, vehicles)
        if settings.draws.yielding_share > 0.0:
            yield_to_egos(paths, lanes, idm, episodes, vehicles)
        move_vehicles(paths.exit_m, paths.lane, settings.step_s, episodes, vehicles, counts)
        move_egos(settings, episodes, actions)
        note_time_gaps(first_zone_m, lanes, paths, settings, state)
        conclude(ego, paths, settings, state)


@kernel
def count_decisions(episodes: Episodes, counts: Counts, actions: Integers) -> None:
    """Count actions (B,) and their changes where a decision is due."""
    for b in range(len(actions)):
        if not episodes.running[b] or episodes.phase[b] != 0:
            continue
        action, last = actions[b], counts.last_action[b]
        counts.action_counts[b, action] += 1
        counts.action_changes[b] += last not in (NO_ACTION, action)
        counts.last_action[b] = action
        counts.speed_at_decision_mps[b] = episodes.ego_speed_mps[b]


@kernel
def move_vehicles(
    exit_m: Floats,
    lane: Integers,
    step_s: float,
    episodes: Episodes,
    vehicles: Vehicles,
    counts: Counts,
) -> None:
    """Move all other vehicles under their accelerations, noting who leaves a conflict zone.

    exit_m, lane (P,): end of the zone on each path, and its lane.
    """
    driving, path, s_m, speed_mps = (
        vehicles.driving,
        vehicles.path,
        vehicles.s_m,
        vehicles.speed_mps,
    )
    acceleration_mps2 = vehicles.acceleration_mps2
    batch, count = driving.shape
    for b in range(batch):
        if not episodes.running[b]:
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
                counts.last_left_s[b, lane[p]] = (episodes.tick[b] + 1) * step_s


@kernel
def move_egos(settings: Settings, episodes: Episodes, actions: Integers) -> None:
    """Let every ego carry out its action (B,), and let time pass."""
    ego = settings.ego
    for b in range(len(actions)):
        if not episodes.running[b]:
            continue
        episodes.tick[b] += 1
        phase = episodes.phase[b] + 1
        episodes.phase[b] = phase if phase < settings.decision_steps else 0
        way, episodes.ego_speed_mps[b] = follow_target(
            episodes.ego_speed_mps[b],
            target_speed(actions[b], ego.slow_mps, ego.fast_mps),
            settings.step_s,
            ego.acceleration_mps2,
            ego.braking_mps2,
        )
        episodes.ego_s_m[b] += way
        episodes.ego_step_m[b] = way


@kernel
def note_time_gaps(
    first_zone_m: float, lanes: Lanes, paths: Paths, settings: Settings, state: SimulationState
) -> None:
    """Note time gaps where an ego has just entered or left a conflict zone."""
    episodes, least_s = state.episodes, state.counts.least_time_gap_s
    for b in range(len(least_s)):
        after = episodes.ego_s_m[b]
        if not episodes.running[b] or after <= first_zone_m:
            continue
        before = after - episodes.ego_step_m[b]
        for lane in range(len(lanes.id)):
            half, center = 0.5 * lanes.ego_zone_m[lane], lanes.ego_zone_center_m[lane]
            if before <= center - half < after:
                now_s = episodes.tick[b] * settings.step_s
                gap_s = now_s - state.counts.last_left_s[b, lane]
                least_s[b] = min(least_s[b], gap_s)
            if before <= center + half < after:
                gap_s = time_to_next(lane, lanes.zone_m[lane], paths, state.vehicles, b)
                least_s[b] = min(least_s[b], gap_s)


@kernel
def time_to_next(lane: int, zone_m: float, paths: Paths, vehicles: Vehicles, b: int) -> float:
    """Return when the next vehicle reaches a lane's zone at its present speed, or infinity."""
    next_s = math.inf
    for i in range(vehicles.driving.shape[1]):
        p = vehicles.path[b, i]
        way = paths.exit_m[p] - zone_m - vehicles.s_m[b, i]
        if vehicles.driving[b, i] and paths.lane[p] == lane and way >= 0.0:
            next_s = min(next_s, way / max(vehicles.speed_mps[b, i], _STANDING_MPS))
    return next_s


@kernel
def conclude(ego: EgoLane, paths: Paths, settings: Settings, state: SimulationState) -> None:
    """End episodes at a collision, the goal or the time limit, in this order."""
    episodes, counts = state.episodes, state.counts
    low, high = ego.contact_low_m, ego.contact_high_m
    for b in range(len(episodes.running)):
        if not episodes.running[b]:
            continue
        ego_s = episodes.ego_s_m[b]
        if low <= ego_s <= high and collides(ego, paths, state.vehicles, b, ego_s):
            episodes.collided[b] = True
        elif ego_s >= ego.goal_m:
            episodes.reached_goal[b] = True
        elif episodes.tick[b] >= settings.limit_steps:
            episodes.timed_out[b] = True
        ended = episodes.collided[b] or episodes.reached_goal[b] or episodes.timed_out[b]
        episodes.running[b] = not ended
        if ended or episodes.phase[b] == 0:
            lost = counts.speed_at_decision_mps[b] - episodes.ego_speed_mps[b]
            counts.hard_brakes[b] += lost > _HARD_BRAKE_MPS


@kernel
def collides(ego: EgoLane, paths: Paths, vehicles: Vehicles, b: int, ego_s: float) -> bool:
    """Tell whether the ego's footprint overlaps another one in episode b."""
    x, y, heading = table_pose(ego.table, 0, ego_s)
    for i in range(vehicles.driving.shape[1]):
        p, s = vehicles.path[b, i], vehicles.s_m[b, i]
        if not vehicles.driving[b, i]:
            continue
        if s < paths.contact_low_m[p] or s > paths.contact_high_m[p]:
            continue
        other_x, other_y, other_heading = table_pose(paths.table, p, s)
        if footprints_overlap(
            x,
            y,
            heading,
            ego.length_m,
            ego.width_m,
            other_x,
            other_y,
            other_heading,
            paths.vehicle_length_m,
            paths.vehicle_width_m,
        ):
            return True
    return False
