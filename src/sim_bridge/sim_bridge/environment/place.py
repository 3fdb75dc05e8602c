# SPDX-License-Identifier: Apache-2.0
"""Where episodes take place: an intersection of an own map or of any Lanelet2 file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import MapOrigin, RoadMap, load_map
from risk_dqn_planner.situation.config import INSTANTANEOUS, TrackingConfig
from sim_bridge.maps import shipped_map
from sim_bridge.scenarios.loading import Scenario
from sim_bridge.simulation.simulation import Simulation


@dataclass(frozen=True)
class Place:
    """An intersection with the outlines (K, 2) of all lanelets, where no obstacle may stand."""

    map_name: str
    model: IntersectionModel
    outlines: tuple[NDArray[np.float64], ...]

    def simulation(
        self,
        scenario: Scenario,
        batch: int,
        memory: str = INSTANTANEOUS,
        tracking: TrackingConfig | None = None,
    ) -> Simulation:
        """Lay out a scenario here for a batch of episodes; memory and tracking as in Simulation."""
        return Simulation(
            self.model,
            scenario,
            batch,
            keep_out=self.outlines,
            memory=memory,
            tracking=tracking,
        )


def load_place(
    map_name: str,
    route: tuple[int, ...] | None = None,
    origin: MapOrigin | None = None,
    projector: str = "utm",
    sensor_range_m: float = IntersectionConfig.sensor_range_m,
) -> Place:
    """Load an own map by its name, or an .osm file, which needs a route and an origin.

    sensor_range_m: lanes reach at least so far upstream, where the map does; never less than the
    default, so that a shorter sight does not change the roads that traffic comes along.

    Raises:
        ConfigurationError: a file without route. MapError, RouteError: neither can be used.
    """
    if map_name.endswith(".osm"):
        path = Path(map_name)
    else:
        own = shipped_map(map_name)
        path, route, origin = own.path, route or own.route, origin or own.origin
    if route is None:
        raise ConfigurationError(f"{map_name} is no own map, so its route must be given")
    least_m = IntersectionConfig.sensor_range_m
    config = IntersectionConfig(sensor_range_m=max(sensor_range_m, least_m))
    return place_on(map_name, load_map(path, origin, projector), route, config)


def place_on(
    map_name: str,
    road_map: RoadMap,
    route: Sequence[int],
    config: IntersectionConfig | None = None,
) -> Place:
    """Take the intersection along a route of a loaded map.

    config: a scenario whose sensor sees further than 70 m needs lanes of that length.

    Raises:
        RouteError: the route does not fit the map.
    """
    outlines = tuple(
        np.array([(point.x, point.y) for point in lanelet.polygon2d()])
        for lanelet in road_map.lanelet_map.laneletLayer
    )
    model = build_intersection(road_map, route, config or IntersectionConfig())
    return Place(map_name, model, outlines)
