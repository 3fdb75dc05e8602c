# SPDX-License-Identifier: Apache-2.0
"""Simulations for the node: a scenario is laid out when it is first asked for, then kept."""

from risk_dqn_planner.decision import Action
from sim_bridge.environment.place import Place
from sim_bridge.scenario import load_scenario
from sim_bridge.simulation import Simulation


class SimulationShelf:
    """Simulations at one place by the name of their scenario."""

    def __init__(self, place: Place) -> None:
        self._place = place
        self._simulations: dict[str, Simulation] = {}

    def get(self, scenario_name: str) -> Simulation:
        """Return the simulation of a scenario.

        Raises:
            ScenarioError: there is no such scenario, or it does not fit the place.
            NoConflictError: the route meets no intersecting lane.
        """
        if scenario_name not in self._simulations:
            simulation = self._place.simulation(load_scenario(scenario_name), 1)
            _compile(simulation)
            self._simulations[scenario_name] = simulation
        return self._simulations[scenario_name]


def _compile(simulation: Simulation) -> None:
    """Use everything once, so that no episode waits for the compiler."""
    simulation.reset([0])
    simulation.inner_step([Action.STOP])
    simulation.vehicle_poses()
    simulation.visible_area()
