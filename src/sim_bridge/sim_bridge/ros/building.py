# SPDX-License-Identifier: Apache-2.0
"""Simulations for the node: a scenario is laid out when it is first asked for, then kept."""

from collections.abc import Sequence

from risk_dqn_planner.decision import Action
from risk_dqn_planner.map.loader import RoadMap
from sim_bridge.environment.place import Places, place_on
from sim_bridge.scenarios.loading import load_scenario
from sim_bridge.simulation.simulation import Simulation


class SimulationShelf:
    """Simulations on one route by the name of their scenario."""

    def __init__(self, road_map: RoadMap, route: Sequence[int]) -> None:
        name, ids = str(road_map.path), tuple(route)
        self._places = Places(lambda reach_m: place_on(name, road_map, ids, reach_m))
        self._simulations: dict[str, Simulation] = {}

    def get(self, scenario_name: str) -> Simulation:
        """Return the simulation of a scenario.

        Raises:
            ScenarioError: there is no such scenario, or it does not fit the route.
            RouteError: the route does not fit the map or meets no intersecting lane.
        """
        if scenario_name not in self._simulations:
            scenario = load_scenario(scenario_name)
            simulation = self._places.of(scenario).simulation(scenario, 1)
            _compile(simulation)
            self._simulations[scenario_name] = simulation
        return self._simulations[scenario_name]


def _compile(simulation: Simulation) -> None:
    """Use everything once, so that no episode waits for the compiler."""
    simulation.reset([0])
    simulation.inner_step([Action.STOP])
    simulation.vehicle_poses()
    simulation.visible_area()
