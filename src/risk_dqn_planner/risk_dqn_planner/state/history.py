# SPDX-License-Identifier: Apache-2.0
"""The state: the last five scenes, each vehicle and lane with its own history (SPEC 2)."""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.errors import InputError
from risk_dqn_planner.situation.situations import Booleans, Integers, Situations
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
    fill_slots,
    recall,
    remember_lanes,
    remember_vehicles,
    select,
)


class Memory(NamedTuple):
    """What an encoder remembers of B rows.

    known (B,): how many scenes, at most 5. scenes (B, 5, 3, 8): ring of scenes as they were.
    """

    known: Integers
    scenes: States
    vehicles: Track
    lanes: Track


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
        self._memory = _new_memory(0, 0, 0)

    def encode(
        self, situations: Situations, restart: Booleans, out: States | None = None
    ) -> States:
        """Return the states (B, 5, 3, 8), float32 in [-1, 1], in `out` if it is given.

        Raises InputError if shapes disagree or the batch changes its size without restarting
        all its rows.
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
        self._head = (self._head + 1) % SCENES
        encode_into(situations, restart, self._parameters, self._head, self._memory, out)
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
            self._memory = _new_memory(batch, vehicles, lanes)
            return
        vehicle_room, lane_room = old.vehicles.number.shape[2], old.lanes.number.shape[2]
        if vehicles > vehicle_room or lanes > lane_room:
            # Twice the need, so that a slowly filling road does not copy at every step.
            vehicle_room, lane_room = max(2 * vehicles, vehicle_room), max(lanes, lane_room)
            self._memory = _new_memory(batch, vehicle_room, lane_room)
            self._memory.known[:] = old.known
            self._memory.scenes[:] = old.scenes
            _copy_track(old.vehicles, self._memory.vehicles)
            _copy_track(old.lanes, self._memory.lanes)


def _new_memory(batch: int, vehicles: int, lanes: int) -> Memory:
    def track(room: int) -> Track:
        shape = (batch, SCENES, room)
        return Track(
            entries=np.zeros((batch, SCENES), dtype=np.int64),
            number=np.zeros(shape, dtype=np.int64),
            lane=np.zeros(shape, dtype=np.int64),
            values=np.zeros((*shape, ROWS), dtype=np.float32),
        )

    return Memory(
        known=np.zeros(batch, dtype=np.int64),
        scenes=np.zeros((batch, SCENES, ROWS, COLUMNS), dtype=np.float32),
        vehicles=track(vehicles),
        lanes=track(lanes),
    )


def _copy_track(old: Track, new: Track) -> None:
    room = old.number.shape[2]
    new.entries[:] = old.entries
    new.number[:, :, :room] = old.number
    new.lane[:, :, :room] = old.lane
    new.values[:, :, :room] = old.values


@kernel
def encode_into(
    s: Situations,
    restart: Booleans,
    p: StateParameters,
    head: int,
    memory: Memory,
    out: States,
) -> None:
    """Encode each row into `out` (B, 5, 3, 8) and remember it at place `head` of the rings."""
    vehicle_slots, lane_slots = np.empty(VEHICLES, np.int64), np.empty(LANES, np.int64)
    ego_distance = np.empty(s.lane_mask.shape[1])
    critical = np.empty(max(s.vehicle_mask.shape[1], s.lane_mask.shape[1]))
    for row in range(s.ego_speed_mps.shape[0]):
        memory.known[row] = 1 if restart[row] else min(memory.known[row] + 1, SCENES)
        known = memory.known[row]
        out[row, 0, 0, 0] = encode_distance(s.stop_line_distance_m[row], p.stop_line_max_m)
        out[row, 0, 1, 0] = encode_speed(s.ego_speed_mps[row], p.ego_speed_max_mps)
        out[row, 0, 2, 0] = encode_distance(s.goal_distance_m[row], p.goal_max_m)
        remember_lanes(s, row, p, head, memory.lanes, ego_distance, critical)
        lanes = select(memory.lanes, row, head, critical, lane_slots)
        remember_vehicles(s, row, p, head, memory.vehicles, ego_distance, critical)
        vehicles = select(memory.vehicles, row, head, critical, vehicle_slots)
        fill_slots(memory.vehicles, row, head, vehicle_slots, vehicles, 1, out)
        fill_slots(memory.lanes, row, head, lane_slots, lanes, 1 + VEHICLES, out)
        columns = COLUMNS if p.stacked else 1
        remember_scene(memory.scenes, row, head, columns, out)
        recall_scenes(memory.scenes, row, head, known, columns, out)
        if not p.stacked:
            recall(memory.vehicles, row, head, known, vehicle_slots, vehicles, 1, out)
            recall(memory.lanes, row, head, known, lane_slots, lanes, 1 + VEHICLES, out)


@kernel
def remember_scene(scenes: States, row: int, head: int, columns: int, out: States) -> None:
    """Keep the first `columns` of the present scene as they are."""
    for i in range(ROWS):
        for column in range(columns):
            scenes[row, head, i, column] = out[row, 0, i, column]


@kernel
def recall_scenes(
    scenes: States, row: int, head: int, known: int, columns: int, out: States
) -> None:
    """Fill the first `columns` of earlier scenes as they were; unknown ones repeat the oldest."""
    for k in range(1, SCENES):
        then = (head - k) % SCENES
        for i in range(ROWS):
            for column in range(columns):
                out[row, k, i, column] = (
                    scenes[row, then, i, column] if k < known else out[row, k - 1, i, column]
                )
