# SPDX-License-Identifier: Apache-2.0
"""Where episodes take place: an intersection of an own map or of any Lanelet2 file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import DEFAULT_PROJECTOR, MapOrigin, RoadMap, load_map
from risk_dqn_planner.situation.config import INSTANTANEOUS, TrackingConfig
from sim_bridge.maps import chosen_map
from sim_bridge.scenarios.loading import Scenario
from sim_bridge.simulation.simulation import Simulation

# A shorter sight does not change the roads that traffic comes along.
USUAL_REACH_M = IntersectionConfig.sensor_range_m


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


class Places:
    """One intersection, with lanes as long as the sensor of a scenario sees.

    Scenarios that see no further than usual share one place, so that longer lanes for the others
    change nothing for them.
    """

    def __init__(self, load: Callable[[float], Place]) -> None:
        """Take what loads the place with lanes of a length [m] upstream."""
        self._load = cache(load)
        self.usual = self._load(USUAL_REACH_M)

    @classmethod
    def named(
        cls,
        map_name: str,
        route: tuple[int, ...] | None = None,
        origin: MapOrigin | None = None,
        projector: str = DEFAULT_PROJECTOR,
    ) -> "Places":
        """Take an own map by its name, or an .osm file.

        Raises:
            ConfigurationError, MapError, RouteError: as `load_place`.
        """
        return cls(lambda reach_m: load_place(map_name, route, origin, projector, reach_m))

    def of(self, scenario: Scenario) -> Place:
        """Return the place for a scenario.

        Raises:
            MapError, RouteError: it cannot be loaded.
        """
        return self._load(max(scenario.sensor.range_m, USUAL_REACH_M))


def load_place(
    map_name: str,
    route: tuple[int, ...] | None = None,
    origin: MapOrigin | None = None,
    projector: str = DEFAULT_PROJECTOR,
    reach_m: float = USUAL_REACH_M,
) -> Place:
    """Load an own map by its name, or an .osm file, which needs a route.

    reach_m: as in `place_on`. Without an origin an .osm file is projected from its first node.

    Raises:
        ConfigurationError: a file without route. MapError, RouteError: neither can be used.
    """
    chosen = chosen_map(map_name, route, origin)
    road_map = load_map(chosen.path, chosen.origin, projector)
    return place_on(map_name, road_map, chosen.route, reach_m)


def place_on(
    map_name: str, road_map: RoadMap, route: Sequence[int], reach_m: float = USUAL_REACH_M
) -> Place:
    """Take the intersection along a route of a loaded map.

    reach_m: lanes reach at least so far upstream, where the map does: as far as the sensor sees.

    Raises:
        RouteError: the route does not fit the map.
    """
    outlines = tuple(
        np.array([(point.x, point.y) for point in lanelet.polygon2d()])
        for lanelet in road_map.lanelet_map.laneletLayer
    )
    # Episodes end at the goal: nobody past it can be run into.
    config = IntersectionConfig(sensor_range_m=reach_m, leaders_beyond_goal_m=0.0)
    model = build_intersection(road_map, route, config)
    return Place(map_name, model, outlines)
