# SPDX-License-Identifier: Apache-2.0
"""Puts the lane-based situation together: one call for each message of perceived objects."""

import math

import numpy as np

from risk_dqn_planner.intersection.model import ConflictKind, IntersectionModel
from risk_dqn_planner.situation.config import TRACKED, SituationConfig
from risk_dqn_planner.situation.ego import ego_progress
from risk_dqn_planner.situation.inputs import (
    EgoPose,
    ObjectArrays,
    check_ego,
    check_objects,
    check_visible_area,
)
from risk_dqn_planner.situation.long_vehicles import fronts_to_join, nearest_ends
from risk_dqn_planner.situation.matching import in_footprint_kernel, match_kernel
from risk_dqn_planner.situation.memory import LaneMemory, Look
from risk_dqn_planner.situation.occlusion import hidden_distances_kernel
from risk_dqn_planner.situation.paths import path_table
from risk_dqn_planner.situation.situations import Floats, Situations, empty_situations
from risk_dqn_planner.situation.vanished import Vanished


class SituationBuilder:
    """Relates what is perceived to the lanes of one intersection model.

    memory: of what has been seen, where the configuration asks for it; else None, and `build`
    knows of nothing but its arguments.
    """

    def __init__(self, model: IntersectionModel, config: SituationConfig | None = None) -> None:
        self.model = model
        self.config = config or SituationConfig()
        self._table = path_table(model)
        limits = np.array([lane.speed_limit_mps for lane in model.lanes])
        self._hidden_mps = limits * self.config.tracking.speed_factor
        self._exit_m = np.array([-0.5 * lane.zone_length_m for lane in model.lanes])
        self._vanished = Vanished(self._hidden_mps, self.config.tracking)
        self.memory: LaneMemory | None = None
        if self.config.memory == TRACKED:
            self.memory = LaneMemory(self._table, limits, self.config)

    def forget(self) -> None:
        """Begin an errand: what was perceived before bears on nothing."""
        self._vanished.forget()
        if self.memory is not None:
            self.memory.forget()

    def build(
        self,
        ego: EgoPose,
        objects: ObjectArrays,
        visible_area: Floats,
        visible_area_age_s: float = 0.0,
        time_s: float = math.inf,
    ) -> Situations:
        """Return the situation as a batch of one, vehicles ordered by (id, lane).

        visible_area: simple polygon (K, 2) in the map frame. An object whose centre lies in the
        ego's footprint is the ego itself and is left out. visible_area_age_s: how much older than
        the objects the area is; whoever was hidden then may have come on since, and whoever has
        gone out of sight since is hidden. time_s: when the objects were perceived, on any clock;
        without a time nothing is remembered.

        Raises:
            InputError: an input is not finite or not plausible; names which.
            EgoPoseError: the ego is off its route or faces the wrong way.
        """
        check_ego(ego)
        check_objects(objects)
        check_visible_area(visible_area)
        ego_s = ego_progress(self.model, ego, self.config)
        lanes = self.model.lanes
        filled, nearest = self._with_vehicles(ego, ego_s, objects)
        age_s = abs(visible_area_age_s)
        released = self._vanished.look(time_s, age_s, objects.id, nearest)
        look = Look(time_s, ego, nearest, visible_area, age_s, released)
        return filled._replace(
            stop_line_distance_m=np.array([self.model.stop_line.position_m - ego_s]),
            goal_distance_m=np.array([self.model.goal_m - ego_s]),
            ego_speed_mps=np.array([ego.speed_mps]),
            lane_mask=np.ones((1, len(lanes)), dtype=np.bool_),
            lane_id=np.array([[lane.lane_id for lane in lanes]], dtype=np.int64),
            lane_merging=np.array([[lane.kind == ConflictKind.MERGING for lane in lanes]]),
            lane_ego_distance_m=np.array([[lane.ego_zone_center_m - ego_s for lane in lanes]]),
            lane_hidden_distance_m=self._hidden_distances(look, filled)[None, :],
            lane_speed_limit_mps=np.array([[lane.speed_limit_mps for lane in lanes]]),
            lane_ego_zone_m=np.array([[lane.ego_zone_length_m for lane in lanes]]),
            lane_zone_m=np.array([[lane.zone_length_m for lane in lanes]]),
        )

    def _hidden_distances(self, look: Look, filled: Situations) -> Floats:
        """Return d_o (M,): how near a hidden vehicle may be, by memory or as the ego sees now.

        Where a vehicle looked at is nearer than it counts in `filled`, one counts as hidden.
        """
        hidden_m = self._seen_now(look) if self.memory is None else self.memory.look(look)
        nearest_m: Floats = np.minimum(hidden_m, np.maximum(self._vanished.nearest_m, self._exit_m))
        fronts = look.seen.vehicle_distance_m < filled.vehicle_distance_m
        lane, front_m = look.seen.vehicle_lane[fronts], look.seen.vehicle_distance_m[fronts]
        np.minimum.at(nearest_m, lane, front_m)
        return nearest_m

    def _seen_now(self, look: Look) -> Floats:
        """Return how near a hidden vehicle may be by the visible area alone (M,)."""
        hidden_m = hidden_distances_kernel(
            self._table,
            len(self.model.lanes),
            np.ascontiguousarray(look.visible_area, dtype=np.float64),
            self.config.sensor_range_m,
        )
        come_on_m = self._hidden_mps * look.visible_area_age_s
        nearest_m: Floats = np.maximum(hidden_m - come_on_m, self._exit_m)
        return nearest_m

    def _with_vehicles(
        self, ego: EgoPose, ego_s: float, objects: ObjectArrays
    ) -> tuple[Situations, Situations]:
        """Return a situation of vehicles only, and that of `fronts_to_join` where there are such.

        The second is for what is remembered of whoever goes out of sight.
        """
        config = self.config
        who, lane, distance, speed = match_kernel(
            self._table,
            objects,
            config.lateral_tolerance_m,
            config.max_heading_difference_rad,
            self.model.traffic_dimensions.length_m,
            config.position_error_m,
        )
        others = np.array([not self._is_ego(ego, objects, i) for i in who], dtype=np.bool_)
        who, lane, distance, speed = who[others], lane[others], distance[others], speed[others]
        pairs = (self.model, ego_s, lane, distance, objects.length_m[who])
        distance, fronts_m = nearest_ends(*pairs), fronts_to_join(*pairs)
        order = np.lexsort((lane, objects.id[who]))
        # At least one place, so that nobody has to think of arrays without entries.
        situations = empty_situations(1, max(len(order), 1), len(self.model.lanes))
        count = len(order)
        situations.vehicle_mask[0, :count] = True
        situations.vehicle_id[0, :count] = objects.id[who[order]]
        situations.vehicle_lane[0, :count] = lane[order]
        situations.vehicle_distance_m[0, :count] = distance[order]
        situations.vehicle_speed_mps[0, :count] = speed[order]
        nearest = situations.vehicle_distance_m.copy()
        nearest[0, :count] = np.minimum(distance, fronts_m)[order]
        return situations, situations._replace(vehicle_distance_m=nearest)

    def _is_ego(self, ego: EgoPose, objects: ObjectArrays, index: int) -> bool:
        size = self.model.ego_dimensions
        return in_footprint_kernel(
            objects.x_m[index],
            objects.y_m[index],
            ego.x_m,
            ego.y_m,
            ego.heading_rad,
            size.length_m,
            size.width_m,
        )
