# SPDX-License-Identifier: Apache-2.0
"""From parameters to simulations: the map is loaded once, a scenario laid out when first asked."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.map.loader import RoadMap
from sim_bridge.scenario import load_scenario
from sim_bridge.simulation import Simulation


def lanelet_outlines(road_map: RoadMap) -> list[NDArray[np.float64]]:
    """Return the outlines (K, 2) of all lanelets, on which no obstacle may stand."""
    return [
        np.array([(point.x, point.y) for point in lanelet.polygon2d()])
        for lanelet in road_map.lanelet_map.laneletLayer
    ]


class SimulationShelf:
    """Simulations of one intersection by the name of their scenario."""

    def __init__(self, road_map: RoadMap, route: Sequence[int]) -> None:
        """Build the intersection.

        Raises:
            RouteError: the route does not fit the map or meets no intersecting lane.
        """
        self._model = build_intersection(road_map, route)
        self._outlines = lanelet_outlines(road_map)
        self._simulations: dict[str, Simulation] = {}

    def get(self, scenario_name: str) -> Simulation:
        """Return the simulation of a scenario.

        Raises:
            ScenarioError: there is no such scenario, or it does not fit the intersection.
        """
        if scenario_name not in self._simulations:
            scenario = load_scenario(scenario_name)
            self._simulations[scenario_name] = Simulation(
                self._model, scenario, 1, keep_out=self._outlines
            )
        return self._simulations[scenario_name]
