# SPDX-License-Identifier: Apache-2.0
"""Everything that changes while episodes run: arrays with the batch as first dimension."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.situation.situations import Booleans, Floats, Integers

NOBODY = -1
NO_ACTION = -1
# More than there are ids of vehicles in an episode.
MOST_IDS = 1 << 20


class Episodes(NamedTuple):
    """B episodes and their egos.

    seed (B,); tick (B,): inner steps done; phase (B,): those since the last decision, 0 where
    one is due; running (B,): False once the episode has ended.
    reached_goal, collided, timed_out (B,): how it ended.
    ego_s_m (B,): along the ego's path; ego_step_m (B,): moved in the last inner step;
    ego_speed_mps (B,).
    obstacle (B, O): index into the catalogue of the left (even places) or the right side, -1 none.
    next_id (B,): id of the next vehicle.
    """

    seed: NDArray[np.uint64]
    tick: Integers
    phase: Integers
    running: Booleans
    reached_goal: Booleans
    collided: Booleans
    timed_out: Booleans
    ego_s_m: Floats
    ego_step_m: Floats
    ego_speed_mps: Floats
    obstacle: Integers
    next_id: Integers


class Vehicles(NamedTuple):
    """N places for vehicles in each of B episodes, all (B, N).

    driving: there is a vehicle; waiting: there will be one, far upstream, as soon as there is
    room; else the place is empty. id: unique in an episode; path: index into P paths; s_m: along
    the path; acceleration_mps2: of the last inner step; yields: lets the ego go first;
    follows_ego: has taken the ego for its leader. leader: place of the vehicle ahead, -1 none;
    leader_offset_m: what to add to the leader's s to have it on the own path; leader_due: it may
    be another one now. Drivers look for their leader once per decision period at most.
    hold_m: arc length before which to wait for others to cross, infinity for going on.
    """

    driving: Booleans
    waiting: Booleans
    id: Integers
    path: Integers
    s_m: Floats
    speed_mps: Floats
    desired_speed_mps: Floats
    acceleration_mps2: Floats
    yields: Booleans
    follows_ego: Booleans
    leader: Integers
    leader_offset_m: Floats
    leader_due: Booleans
    hold_m: Floats


class Counts(NamedTuple):
    """What is counted during B episodes.

    start_s_m (B,): of the ego. action_counts (B, 3): decision steps by action.
    action_changes (B,): decisions that differ from the one before. last_action (B,).
    hard_brakes (B,): decision steps that took more than 1 m/s off the ego's speed.
    speed_at_decision_mps (B,): of the ego. least_time_gap_s (B,): shortest time between ego and
    another vehicle at a conflict zone, infinity if none came: from the vehicle's leaving to the
    ego's entering, or from the ego's leaving to the vehicle's entering at its present speed.
    last_left_s (B, M): when a vehicle last left each lane's zone.
    """

    start_s_m: Floats
    action_counts: Integers
    action_changes: Integers
    last_action: Integers
    hard_brakes: Integers
    speed_at_decision_mps: Floats
    least_time_gap_s: Floats
    last_left_s: Floats


class SimulationState(NamedTuple):
    """All that changes."""

    episodes: Episodes
    vehicles: Vehicles
    counts: Counts


def empty_state(batch: int, vehicles: int, obstacles: int, lanes: int) -> SimulationState:
    """Return a state in which no episode runs."""

    def booleans() -> Booleans:
        return np.zeros(batch, dtype=np.bool_)

    def integers(value: int = 0) -> Integers:
        return np.full(batch, value, dtype=np.int64)

    episodes = Episodes(
        seed=np.zeros(batch, dtype=np.uint64),
        tick=integers(),
        phase=integers(),
        running=booleans(),
        reached_goal=booleans(),
        collided=booleans(),
        timed_out=booleans(),
        ego_s_m=np.zeros(batch),
        ego_step_m=np.zeros(batch),
        ego_speed_mps=np.zeros(batch),
        obstacle=np.full((batch, obstacles), NOBODY, dtype=np.int64),
        next_id=integers(1),
    )
    counts = Counts(
        start_s_m=np.zeros(batch),
        action_counts=np.zeros((batch, 3), dtype=np.int64),
        action_changes=integers(),
        last_action=integers(NO_ACTION),
        hard_brakes=integers(),
        speed_at_decision_mps=np.zeros(batch),
        least_time_gap_s=np.full(batch, np.inf),
        last_left_s=np.full((batch, lanes), -np.inf),
    )
    return SimulationState(episodes, _empty_vehicles(batch, vehicles), counts)


def _empty_vehicles(batch: int, vehicles: int) -> Vehicles:
    shape = (batch, vehicles)
    return Vehicles(
        driving=np.zeros(shape, dtype=np.bool_),
        waiting=np.zeros(shape, dtype=np.bool_),
        id=np.zeros(shape, dtype=np.int64),
        path=np.zeros(shape, dtype=np.int64),
        s_m=np.zeros(shape),
        speed_mps=np.zeros(shape),
        desired_speed_mps=np.ones(shape),
        acceleration_mps2=np.zeros(shape),
        yields=np.zeros(shape, dtype=np.bool_),
        follows_ego=np.zeros(shape, dtype=np.bool_),
        leader=np.full(shape, NOBODY, dtype=np.int64),
        leader_offset_m=np.zeros(shape),
        leader_due=np.zeros(shape, dtype=np.bool_),
        hold_m=np.full(shape, np.inf),
    )
