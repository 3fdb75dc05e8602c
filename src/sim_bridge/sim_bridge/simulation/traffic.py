# SPDX-License-Identifier: Apache-2.0
"""How other vehicles drive: the Intelligent Driver Model along fixed paths.

They do not react to the ego, which is the paper's worst case, with two exceptions: a vehicle
whose own lane the ego has entered far enough ahead follows it like any leader, or no merge could
be survived; and a vehicle of the yielding share waits before its zone while the ego comes.
"""

import math

from risk_dqn_planner.compiled import kernel
from sim_bridge.simulation.settings import Idm
from sim_bridge.simulation.state import NOBODY, Episodes, Vehicles
from sim_bridge.world.sharing import EgoSharing, Sharing
from sim_bridge.world.world import Lanes, Paths

# A vehicle that yields may brake this much harder than is comfortable before it gives up: then
# the model's own braking, which tends to the comfortable one from below, never ends the yielding.
_YIELD_EFFORT = 1.5
# It cares for an ego that stands in its zone, or moves and is at most this far before it.
_YIELD_WITHIN_M = 15.0
_MOVING_MPS = 0.5


@kernel
def idm_acceleration(
    speed_mps: float, desired_mps: float, gap_m: float, leader_mps: float, idm: Idm
) -> float:
    """Return the acceleration of the Intelligent Driver Model; gap infinity for a free road.

    a (1 - (v / v0)^4 - (s* / gap)^2), s* = s0 + max(0, v T + v (v - v_leader) / (2 sqrt(a b))),
    not below the strongest braking (Treiber, Hennecke, Helbing 2000).
    """
    share = speed_mps / desired_mps
    square = share * share
    closing = speed_mps * (speed_mps - leader_mps) * idm.half_inverse_root_ab
    wanted = idm.standstill_gap_m + max(0.0, speed_mps * idm.time_headway_s + closing)
    ratio = wanted / max(gap_m, 1e-3)
    acceleration = idm.acceleration_mps2 * (1.0 - square * square - ratio * ratio)
    return max(acceleration, -idm.strongest_mps2)


@kernel
def accepts_ego(gap_m: float, speed_mps: float, ego_mps: float, idm: Idm) -> bool:
    """Tell whether braking comfortably keeps the standstill gap to the ego ahead."""
    closing = max(speed_mps - ego_mps, 0.0)
    room = gap_m - idm.standstill_gap_m
    return room >= 0.0 and closing * closing <= 2.0 * idm.comfortable_mps2 * room


@kernel
def yields_now(
    gap_m: float,
    speed_mps: float,
    ego_distance_m: float,
    half_ego_zone_m: float,
    ego_mps: float,
    idm: Idm,
) -> bool:
    """Tell whether a yielding vehicle, `gap_m` before its zone, waits there for the ego.

    It does while the ego stands in the zone or comes, if it can still stop.
    """
    coming = ego_distance_m < half_ego_zone_m + _YIELD_WITHIN_M and ego_mps > _MOVING_MPS
    inside = -half_ego_zone_m < ego_distance_m < half_ego_zone_m
    if gap_m <= 0.0 or ego_distance_m < -half_ego_zone_m or not (coming or inside):
        return False
    return speed_mps * speed_mps <= 2.0 * _YIELD_EFFORT * idm.comfortable_mps2 * gap_m


@kernel
def find_leaders(sharing: Sharing, episodes: Episodes, vehicles: Vehicles) -> None:
    """Where a decision is due, find the nearest vehicle ahead of those whose leader may change.

    Those are the ones marked `leader_due`, and all if anyone is near a fork or a join.
    """
    running, phase = episodes.running, episodes.phase
    driving, path, s_m = vehicles.driving, vehicles.path, vehicles.s_m
    leader, leader_offset_m, due = vehicles.leader, vehicles.leader_offset_m, vehicles.leader_due
    low_m, high_m, offset_m = sharing.low_m, sharing.high_m, sharing.offset_m
    change_low_m, change_high_m = sharing.change_low_m, sharing.change_high_m
    batch, count = driving.shape
    for b in range(batch):
        if not running[b] or phase[b] != 0:
            continue
        everyone = False
        for i in range(count):
            p, own = path[b, i], s_m[b, i]
            everyone |= driving[b, i] & (own >= change_low_m[p]) & (own <= change_high_m[p])
        for i in range(count):
            if not (everyone or due[b, i]):
                continue
            due[b, i] = False
            p, own = path[b, i], s_m[b, i]
            nearest, found = math.inf, NOBODY
            for j in range(count):
                q, s = path[b, j], s_m[b, j]
                ahead = s + offset_m[p, q] - own
                # Of two side by side on branches that join, the lower place goes first. Written
                # without branches, which a processor could not foresee.
                before = (ahead > 0.0) | ((ahead == 0.0) & (j < i))
                on_path = (s >= low_m[p, q]) & (s <= high_m[p, q])
                if driving[b, j] & on_path & before & (ahead < nearest):
                    nearest, found = ahead, j
            leader[b, i] = found
            if found != NOBODY:
                leader_offset_m[b, i] = offset_m[p, path[b, found]]


@kernel
def follow_leaders(length_m: float, idm: Idm, episodes: Episodes, vehicles: Vehicles) -> None:
    """Set all accelerations from where everyone is now, as if the ego were not there."""
    s_m, speed_mps, desired_mps = vehicles.s_m, vehicles.speed_mps, vehicles.desired_speed_mps
    leader, leader_offset_m = vehicles.leader, vehicles.leader_offset_m
    acceleration_mps2, running = vehicles.acceleration_mps2, episodes.running
    batch, count = s_m.shape
    for b in range(batch):
        if not running[b]:
            continue
        for i in range(count):
            gap_m, leader_mps = math.inf, 0.0
            j = leader[b, i]
            if j != NOBODY:
                gap_m = s_m[b, j] + leader_offset_m[b, i] - s_m[b, i] - length_m
                leader_mps = speed_mps[b, j]
            acceleration_mps2[b, i] = idm_acceleration(
                speed_mps[b, i], desired_mps[b, i], gap_m, leader_mps, idm
            )


@kernel
def _brake_behind(vehicles: Vehicles, b: int, i: int, gap_m: float, mps: float, idm: Idm) -> None:
    """Let vehicle i brake at least as hard as something `gap_m` ahead, moving at `mps`, takes."""
    acceleration = idm_acceleration(
        vehicles.speed_mps[b, i], vehicles.desired_speed_mps[b, i], gap_m, mps, idm
    )
    vehicles.acceleration_mps2[b, i] = min(vehicles.acceleration_mps2[b, i], acceleration)


@kernel
def follow_egos(
    lengths_m: float,
    first_zone_m: float,
    ego_sharing: EgoSharing,
    idm: Idm,
    episodes: Episodes,
    vehicles: Vehicles,
) -> None:
    """Let vehicles on merging paths follow the ego once it is in their lane, far enough ahead.

    lengths_m: half the ego's and half a vehicle's length.
    """
    from_m, until_m, offset_m = ego_sharing.from_m, ego_sharing.until_m, ego_sharing.offset_m
    running, ego_s_m, ego_speed_mps = episodes.running, episodes.ego_s_m, episodes.ego_speed_mps
    driving, path, s_m, speed_mps = (
        vehicles.driving,
        vehicles.path,
        vehicles.s_m,
        vehicles.speed_mps,
    )
    follows = vehicles.follows_ego
    batch, count = path.shape
    for b in range(batch):
        ego_m, ego_mps = ego_s_m[b], ego_speed_mps[b]
        if ego_m < first_zone_m or not running[b]:
            continue
        for i in range(count):
            p = path[b, i]
            if ego_m < from_m[p] or ego_m > until_m[p] or not driving[b, i]:
                continue
            gap_m = ego_m + offset_m[p] - s_m[b, i] - lengths_m
            follows[b, i] = follows[b, i] or accepts_ego(gap_m, speed_mps[b, i], ego_mps, idm)
            if follows[b, i]:
                _brake_behind(vehicles, b, i, gap_m, ego_mps, idm)


@kernel
def wait_for_others(idm: Idm, episodes: Episodes, vehicles: Vehicles) -> None:
    """Let vehicles that have to wait where paths cross stop before."""
    hold_m, s_m = vehicles.hold_m, vehicles.s_m
    batch, count = hold_m.shape
    for b in range(batch):
        for i in range(count):
            # Who is too near to stop goes on, and is waited for.
            if hold_m[b, i] < math.inf and hold_m[b, i] > s_m[b, i] and episodes.running[b]:
                _brake_behind(vehicles, b, i, hold_m[b, i] - s_m[b, i], 0.0, idm)


@kernel
def yield_to_egos(
    paths: Paths, lanes: Lanes, idm: Idm, episodes: Episodes, vehicles: Vehicles
) -> None:
    """Let vehicles of the yielding share stop before their zone while the ego comes."""
    batch, count = vehicles.path.shape
    for b in range(batch):
        for i in range(count):
            if not (episodes.running[b] and vehicles.driving[b, i] and vehicles.yields[b, i]):
                continue
            p = vehicles.path[b, i]
            lane = paths.lane[p]
            gap_m = paths.enter_m[p] - vehicles.s_m[b, i]
            if yields_now(
                gap_m,
                vehicles.speed_mps[b, i],
                lanes.ego_zone_center_m[lane] - episodes.ego_s_m[b],
                0.5 * lanes.ego_zone_m[lane],
                episodes.ego_speed_mps[b],
                idm,
            ):
                _brake_behind(vehicles, b, i, gap_m, 0.0, idm)
