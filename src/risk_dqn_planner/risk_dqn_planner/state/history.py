# SPDX-License-Identifier: Apache-2.0
"""The state: the last five scenes, each vehicle and lane with its own history (docs/paper.md)."""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.errors import InputError
from risk_dqn_planner.settled import Settled
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations
from risk_dqn_planner.state.encoding import (
    COLUMNS,
    LANES,
    ROWS,
    SCENES,
    VEHICLES,
    StateConfig,
    StateParameters,
    encode_distance,
    encode_speed,
)
from risk_dqn_planner.state.tracks import (
    States,
    Track,
    recall,
    remember_lanes,
    remember_vehicles,
    scene_before,
    select,
)


class Memory(NamedTuple):
    """What an encoder remembers of B rows.

    known (B,): how many scenes, at most 5. scenes (B, 5, 3, C): ring of scenes as they were, the
    first C columns: the ego, or where scenes are stacked all. ego_distance (B, M): d_e,i now.
    """

    known: Integers
    scenes: States
    vehicles: Track
    lanes: Track
    ego_distance: Floats


class StateEncoder:
    """Turns situations, given one after the other 0.5 s apart, into states of the network.

    The same object serves a batch in training and a batch of one on the vehicle; rows are
    independent. `restart` marks rows whose past is void: a new episode or a gap in the input.
    Their history, like any that is not known yet, repeats the oldest known value. Where a
    vehicle was out of sight k scenes ago, the value of the next later scene stands in.
    """

    def __init__(self, config: StateConfig | None = None) -> None:
        self.config = config or StateConfig()
        self._parameters = self.config.parameters()
        self._head = 0
        self._columns = COLUMNS if self.config.stacked else 1
        self._encode = Settled(encode_into)
        self._memory = _new_memory(0, 0, 0, self._columns)

    def encode(
        self, situations: Situations, restart: Booleans, out: States | None = None
    ) -> States:
        """Return the states (B, 5, 3, 8), float32 in [-1, 1], in `out` if it is given.

        Raises InputError if shapes disagree, `out` has gaps in memory, or the batch changes its
        size without restarting all its rows.
        """
        shape = (situations.ego_speed_mps.shape[0], SCENES, ROWS, COLUMNS)
        self._make_room(situations, restart)
        if out is None:
            out = np.empty(shape, dtype=np.float32)
        if out.shape != shape or restart.shape != shape[:1]:
            raise InputError(
                f"out has shape {out.shape} and restart {restart.shape}, "
                f"expected {shape} and {shape[:1]}"
            )
        if not out.flags.c_contiguous:
            raise InputError(f"out has strides {out.strides}, expected an array without gaps")
        self._head = (self._head + 1) % SCENES
        self._encode(situations, restart, self._parameters, self._head, self._memory, out)
        return out

    def _make_room(self, situations: Situations, restart: Booleans) -> None:
        batch, vehicles = situations.vehicle_mask.shape
        lanes = situations.lane_mask.shape[1]
        old = self._memory
        if batch != old.known.shape[0]:
            if old.known.shape[0] and not np.all(restart):
                raise InputError(
                    f"the batch has {batch} situations, expected {old.known.shape[0]} as before"
                )
            self._memory = _new_memory(batch, vehicles, lanes, self._columns)
            return
        vehicle_room, lane_room = old.vehicles.number.shape[2], old.lanes.number.shape[2]
        if vehicles > vehicle_room or lanes > lane_room:
            # Twice the need, so that a slowly filling road does not copy at every step.
            vehicle_room, lane_room = max(2 * vehicles, vehicle_room), max(lanes, lane_room)
            self._memory = _new_memory(batch, vehicle_room, lane_room, self._columns)
            self._memory.known[:] = old.known
            self._memory.scenes[:] = old.scenes
            _copy_track(old.vehicles, self._memory.vehicles)
            _copy_track(old.lanes, self._memory.lanes)


def _new_memory(batch: int, vehicles: int, lanes: int, columns: int) -> Memory:
    def track(room: int) -> Track:
        shape = (batch, SCENES, room)
        return Track(
            entries=np.zeros((batch, SCENES), dtype=np.int64),
            number=np.zeros(shape, dtype=np.int64),
            lane=np.zeros(shape, dtype=np.int64),
            values=np.zeros((*shape, ROWS), dtype=np.float32),
            critical=np.zeros((batch, room)),
        )

    return Memory(
        known=np.zeros(batch, dtype=np.int64),
        scenes=np.zeros((batch, SCENES, ROWS, columns), dtype=np.float32),
        vehicles=track(vehicles),
        lanes=track(lanes),
        ego_distance=np.zeros((batch, lanes)),
    )


def _copy_track(old: Track, new: Track) -> None:
    room = old.number.shape[2]
    new.entries[:] = old.entries
    new.number[:, :, :room] = old.number
    new.lane[:, :, :room] = old.lane
    new.values[:, :, :room] = old.values


@allocating_kernel
def encode_into(
    s: Situations,
    restart: Booleans,
    p: StateParameters,
    head: int,
    memory: Memory,
    out: States,
) -> None:
    """Encode each row into `out` (B, 5, 3, 8) and remember it at place `head` of the rings."""
    known, scenes, ego_distance = memory.known, memory.scenes, memory.ego_distance
    for row in range(len(known)):
        known[row] = 1 if restart[row] else min(known[row] + 1, SCENES)
    encode_egos(s, p, out)
    remember_lanes(s, p, head, memory.lanes, ego_distance)
    remember_vehicles(s, p, head, memory.vehicles, ego_distance)
    # Stacked scenes bring their earlier slots themselves.
    own = np.ones_like(known) if p.stacked else known
    count = np.empty_like(known)
    for track, slots, column in (
        (memory.vehicles, VEHICLES, 1),
        (memory.lanes, LANES, 1 + VEHICLES),
    ):
        chosen = np.empty((len(known), slots), np.int64)
        select(track, head, chosen, count)
        recall(track, head, own, chosen, count, column, out)
    stack_scenes(scenes, head, known, out)


@kernel
def encode_egos(s: Situations, p: StateParameters, out: States) -> None:
    """Fill what the present scene says about the egos."""
    to_stop_line_m, to_goal_m = s.stop_line_distance_m, s.goal_distance_m
    speed_mps = s.ego_speed_mps
    for row in range(len(speed_mps)):
        out[row, 0, 0, 0] = encode_distance(to_stop_line_m[row], p.stop_line_max_m)
        out[row, 0, 1, 0] = encode_speed(speed_mps[row], p.ego_speed_max_mps)
        out[row, 0, 2, 0] = encode_distance(to_goal_m[row], p.goal_max_m)


@kernel
def stack_scenes(scenes: States, head: int, known: Integers, out: States) -> None:
    """Keep the first C columns of the present scene, and fill those of earlier scenes as they were.

    scenes (B, 5, 3, C). Unknown scenes repeat the oldest.
    """
    for row in range(len(known)):
        for i in range(ROWS):
            for column in range(scenes.shape[3]):
                scenes[row, head, i, column] = out[row, 0, i, column]
        for k in range(1, SCENES):
            then = scene_before(head, min(k, known[row] - 1))
            for i in range(ROWS):
                for column in range(scenes.shape[3]):
                    out[row, k, i, column] = scenes[row, then, i, column]
