# SPDX-License-Identifier: Apache-2.0
"""B simulated episodes side by side; the ROS node is a batch of one, training one of thousands."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from risk_dqn_planner.decision import Action
from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.settled import Settled
from risk_dqn_planner.situation.config import INSTANTANEOUS, TrackingConfig
from risk_dqn_planner.situation.hidden_space import HiddenSpace
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations
from risk_dqn_planner.vehicle import EgoLimits
from sim_bridge.perception.perceiver import Perceiver
from sim_bridge.perception.poses import VehiclePoses
from sim_bridge.perception.tracking import Tracker
from sim_bridge.perception.visible_area import visible_polygon
from sim_bridge.scenarios.fields import Scenario
from sim_bridge.simulation.lags import empty_lags, forget_lags
from sim_bridge.simulation.settings import NEVER, reaction_of, settings_of
from sim_bridge.simulation.starting import start_episodes
from sim_bridge.simulation.state import NOBODY, empty_state
from sim_bridge.simulation.stepping import advance, are_actions
from sim_bridge.world.path_geometry import place_ahead, table_pose
from sim_bridge.world.world import build_world


class StepResult(NamedTuple):
    """How B episodes stand after a step, all (B,).

    An ended episode keeps its flags and no longer changes until it is reset.
    ran: it was running when the step began. terminated: reached_goal or collided, a terminal
    state. truncated: timed_out, where learning has to bootstrap.
    """

    ran: Booleans
    reached_goal: Booleans
    collided: Booleans
    timed_out: Booleans
    terminated: Booleans
    truncated: Booleans


class EpisodeStatistics(NamedTuple):
    """Figures of B episodes so far, all (B,) but action_counts (B, 3), by `Action`.

    Actions and hard brakes (steps that take more than 1 m/s off) are counted in decision steps.
    least_time_gap_s: shortest time between the ego's and another vehicle's being in a conflict
    zone, infinity if there was none.
    """

    duration_s: Floats
    progress_m: Floats
    mean_speed_mps: Floats
    action_counts: Integers
    action_changes: Integers
    hard_brakes: Integers
    least_time_gap_s: Floats


class Simulation:
    """B episodes of one scenario at one intersection.

    Public for reading: `model`, `scenario`, `batch`, `world`, `settings`, `state` (see
    SimulationState), `lags` and `tracker`, the planner's memory, None without one. The same seed
    gives the same episode in any batch. What goes on is in `state`, `lags` and `hidden_space`.
    """

    def __init__(
        self,
        model: IntersectionModel,
        scenario: Scenario,
        batch: int,
        world_seed: int = 0,
        keep_out: Sequence[NDArray[np.float64]] = (),
        ego_limits: EgoLimits | None = None,
        memory: str = INSTANTANEOUS,
        tracking: TrackingConfig | None = None,
    ) -> None:
        """Lay out the scenario; `world_seed` and `keep_out` as in `build_world`.

        memory, tracking: how the planner tells where hidden vehicles may be, see SituationConfig.

        Raises:
            ConfigurationError: the batch is empty, or there is no such memory.
            ScenarioError, NoConflictError: the scenario does not fit the model.
        """
        if batch < 1:
            raise ConfigurationError(f"batch is {batch}, expected at least 1")
        self.model = model
        self.scenario = scenario
        self.batch = batch
        self.world = build_world(model, scenario, world_seed, keep_out)
        self.settings = settings_of(scenario, ego_limits or EgoLimits())
        vehicles = int(scenario.traffic.vehicles.high)
        obstacles = 2 * scenario.obstacles.per_side
        self.state = empty_state(batch, vehicles, obstacles, len(model.lanes))
        self._reaction = reaction_of(scenario)
        delay_steps = round(scenario.ego.actuation_delay_s / scenario.timing.inner_step_s)
        self._lagging = delay_steps > 0 or self._reaction.after_steps != NEVER
        self.lags = empty_lags(batch, vehicles, delay_steps, self._reaction)
        self._start, self._go_on = Settled(start_episodes), Settled(advance)
        self._perceiver = Perceiver(self.world, scenario, self.settings, batch, memory, tracking)

    @property
    def tracker(self) -> Tracker | None:
        """The planner's memory, None without one."""
        return self._perceiver.tracker

    @property
    def hidden_space(self) -> HiddenSpace | None:
        """All that the memory holds, to be kept with `state`; None without memory."""
        return None if self.tracker is None else self.tracker.space

    @hidden_space.setter
    def hidden_space(self, space: HiddenSpace | None) -> None:
        if self.tracker is not None and space is not None:
            self.tracker.space = space
        elif self.tracker is not None:
            self.tracker.forget(np.ones(self.batch, dtype=np.bool_))

    def reset(self, seeds: ArrayLike, mask: ArrayLike | None = None) -> None:
        """Start the episodes of seeds (B,), or only those that `mask` (B,) names.

        Raises:
            ConfigurationError: seeds or mask do not have the batch's shape.
        """
        given = np.asarray(seeds)
        chosen = np.ones(self.batch, dtype=np.bool_) if mask is None else np.asarray(mask)
        for name, array in (("seeds", given), ("mask", chosen)):
            if array.shape != (self.batch,):
                raise ConfigurationError(
                    f"{name} has shape {array.shape}, expected ({self.batch},)"
                )
        world = self.world
        self._start(
            world.ego.stop_line_m,
            world.paths,
            world.lanes,
            world.sharing,
            world.obstacles.available,
            self.settings,
            self.state,
            np.ascontiguousarray(given.astype(np.uint64)),
            np.ascontiguousarray(chosen.astype(np.bool_)),
        )
        if self._lagging:
            forget_lags(self.lags, chosen.astype(np.bool_))
        if self.tracker is not None:
            self.tracker.forget(chosen.astype(np.bool_))

    def step(self, actions: ArrayLike) -> StepResult:
        """Carry out actions (B,) for one decision period.

        Raises:
            ConfigurationError: actions of the wrong shape, or not of `Action`.
        """
        return self._advance(actions, self.settings.decision_steps)

    def inner_step(self, actions: ArrayLike) -> StepResult:
        """Carry out actions (B,) for one inner step; `step` is a decision period of them."""
        return self._advance(actions, 1)

    def _advance(self, actions: ArrayLike, steps: int) -> StepResult:
        given = np.ascontiguousarray(actions, dtype=np.int64)
        if given.shape != (self.batch,):
            raise ConfigurationError(f"actions has shape {given.shape}, expected ({self.batch},)")
        if not are_actions(given):
            raise ConfigurationError(
                f"actions range from {given.min()} to {given.max()}, expected 0 to {max(Action)}"
            )
        episodes = self.state.episodes
        ran = episodes.running.copy()
        world = self.world
        self._go_on(
            world.ego,
            world.paths,
            world.lanes,
            world.sharing,
            world.crossings,
            world.ego_sharing,
            world.obstacles.corners,
            self.settings,
            self.state,
            (self._reaction, self.lags) if self._lagging else None,
            given,
            self._perceiver.shadows,
            steps,
        )
        return StepResult(
            ran=ran,
            reached_goal=episodes.reached_goal.copy(),
            collided=episodes.collided.copy(),
            timed_out=episodes.timed_out.copy(),
            terminated=episodes.reached_goal | episodes.collided,
            truncated=episodes.timed_out.copy(),
        )

    def situations(self, out: Situations | None = None) -> Situations:
        """Return what the planner perceives; hidden vehicles are absent.

        `out`, an earlier result of this simulation, is overwritten instead of taking new memory.
        """
        return self._perceiver.situations(self.state, out)

    def statistics(self) -> EpisodeStatistics:
        """Return the figures of the episodes so far."""
        episodes, _, counted = self.state
        duration = episodes.tick.astype(np.float64) * self.settings.step_s
        progress = episodes.ego_s_m - counted.start_s_m
        return EpisodeStatistics(
            duration_s=duration,
            progress_m=progress,
            mean_speed_mps=progress / np.maximum(duration, self.settings.step_s),
            action_counts=counted.action_counts.copy(),
            action_changes=counted.action_changes.copy(),
            hard_brakes=counted.hard_brakes.copy(),
            least_time_gap_s=counted.least_time_gap_s.copy(),
        )

    def ego_poses(self) -> Floats:
        """Return x, y, heading, speed of the egos (B, 4)."""
        episodes = self.state.episodes
        poses = [table_pose(self.world.ego.table, 0, s) for s in episodes.ego_s_m]
        return np.column_stack((np.array(poses), episodes.ego_speed_mps))

    def vehicle_poses(self) -> VehiclePoses:
        """Return the truth about all vehicles, seen or hidden."""
        return self._perceiver.vehicle_poses(self.state)

    def phantom_poses(self) -> VehiclePoses:
        """Return the phantoms (B, M), or (B, 0); the mask has those that the sensor reports now."""
        return self._perceiver.phantom_poses(self.state)

    def obstacles(self, episode: int = 0) -> list[Floats]:
        """Return the corners (4, 2) of one episode's obstacles, counter-clockwise."""
        chosen = self.state.episodes.obstacle[episode]
        corners = self.world.obstacles.corners
        return [corners[o % 2, k].copy() for o, k in enumerate(chosen) if k != NOBODY]

    def visible_area(self, episode: int = 0) -> Floats:
        """Return the polygon (K, 2) that one episode's ego sees."""
        s = self.state.episodes.ego_s_m[episode]
        x, y = place_ahead(self.world.ego.table, 0, s, self.settings.sensor_offset_m)
        return visible_polygon(x, y, self.settings.sensor_range_m, self.obstacles(episode))
