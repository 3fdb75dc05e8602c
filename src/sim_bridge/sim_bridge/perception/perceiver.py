# SPDX-License-Identifier: Apache-2.0
"""What B egos perceive of their episodes, and the truth beside it."""

import numpy as np

from risk_dqn_planner.settled import Settled
from risk_dqn_planner.situation.config import TRACKED, TrackingConfig, require_memory
from risk_dqn_planner.situation.situations import Floats, Situations, empty_situations
from sim_bridge.perception.errors import err, perceive_with_errors
from sim_bridge.perception.perception import empty_view, perceive
from sim_bridge.perception.phantoms import empty_reported
from sim_bridge.perception.poses import VehiclePoses, empty_poses, reveal, reveal_phantoms
from sim_bridge.perception.tracking import Tracker
from sim_bridge.scenarios.fields import Scenario
from sim_bridge.simulation.settings import Settings, sensing_of
from sim_bridge.simulation.state import SimulationState
from sim_bridge.world.matches import most_lanes_at_once
from sim_bridge.world.world import World


class Perceiver:
    """The egos' sensors, and the planner's memory where it has one.

    tracker: the memory, None without one. All else that is kept is overwritten at each look.
    """

    def __init__(
        self,
        world: World,
        scenario: Scenario,
        settings: Settings,
        batch: int,
        memory: str,
        tracking: TrackingConfig | None,
    ) -> None:
        """Put the scenario's sensor on each of B egos; memory, tracking: as in `Simulation`.

        Raises:
            ConfigurationError: there is no such memory.
        """
        require_memory(memory)
        self._world, self._settings = world, settings
        self._batch, lanes = batch, len(world.lanes.id)
        vehicles = int(scenario.traffic.vehicles.high)
        self._sensing = sensing_of(scenario)
        self._phantoms = lanes if self._sensing.phantom_share > 0.0 else 0
        self._erring = any(self._sensing._replace(phantom_steps=0))
        self._view = empty_view(batch, vehicles, 2 * scenario.obstacles.per_side)
        self._reported = empty_reported(batch, vehicles, self._phantoms)
        self._pairs = max((vehicles + self._phantoms) * most_lanes_at_once(world.matches), 1)
        self._perceive = Settled(perceive)
        self._instantaneous_lanes = world.lanes
        self.tracker: Tracker | None = None
        if memory == TRACKED:
            # The memory says how far every lane is free, so nobody else need look along them.
            nothing = np.zeros(1, dtype=np.int64)
            self._instantaneous_lanes = world.lanes._replace(first_path=nothing)
            config = tracking or TrackingConfig()
            self.tracker = Tracker(world, config, scenario.sensor.range_m, batch, self._pairs)

    @property
    def shadows(self) -> Floats:
        """Memory for the shadows of all obstacles (B, O, 4, 3), which every look fills anew."""
        return self._view.shadows

    def situations(self, state: SimulationState, out: Situations | None) -> Situations:
        """Return what the planner perceives, in `out` if that is an earlier result."""
        result = out if out is not None else self._empty_situations()
        episodes, vehicles, _ = state
        world = self._world
        self._perceive(
            world.ego,
            world.paths.table,
            self._instantaneous_lanes,
            world.matches,
            world.sight,
            world.obstacles.corners,
            self._settings,
            episodes,
            vehicles,
            self._view,
            result,
        )
        if self._erring:
            perceive_with_errors(
                world.paths,
                world.lanes,
                world.matches,
                self._settings,
                self._sensing,
                episodes,
                vehicles,
                self._view,
                self._reported,
                result,
            )
        if self.tracker is not None:
            self.tracker.look(episodes.tick, self._settings.step_s, self._view, result)
        return result

    def _empty_situations(self) -> Situations:
        lanes = self._world.lanes
        result = empty_situations(self._batch, self._pairs, len(lanes.id))
        result.lane_mask[:] = True
        result.lane_id[:] = lanes.id
        result.lane_merging[:] = lanes.merging
        result.lane_speed_limit_mps[:] = lanes.limit_mps
        result.lane_ego_zone_m[:] = lanes.ego_zone_m
        result.lane_zone_m[:] = lanes.zone_m
        return result

    def vehicle_poses(self, state: SimulationState) -> VehiclePoses:
        """Return the truth about all vehicles (B, N), seen or hidden."""
        episodes, vehicles, _ = state
        poses = empty_poses(*vehicles.driving.shape)
        poses.mask[:] = vehicles.driving
        poses.id[:] = vehicles.id
        poses.speed_mps[:] = vehicles.speed_mps
        world, view = self._world, self._view
        reveal(
            world.ego,
            world.paths.table,
            world.obstacles.corners,
            self._settings,
            episodes,
            vehicles,
            view,
            poses,
        )
        if self._erring:
            err(self._sensing, episodes, vehicles, view)
        poses.hidden[:] = vehicles.driving & ~view.seen
        poses.measured_speed_mps[:] = view.measured_mps
        return poses

    def phantom_poses(self, state: SimulationState) -> VehiclePoses:
        """Return the phantoms (B, M), or (B, 0); the mask has those that the sensor reports now."""
        world = self._world
        poses = empty_poses(self._batch, self._phantoms)
        if self._phantoms > 0:
            reveal_phantoms(
                world.ego,
                world.paths,
                world.lanes,
                world.obstacles.corners,
                self._settings,
                self._sensing,
                state.episodes,
                self._view,
                self._reported,
                poses,
            )
        return poses
