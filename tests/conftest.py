# SPDX-License-Identifier: Apache-2.0
"""Real node processes for tests, each group in a ROS domain of its own."""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from planner_driver import PlannerDriver

from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import load_map
from sim_bridge.ros.building import SimulationShelf
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.run_settings import RunSettings, own_map_settings
from sim_bridge.ros.session import ros_session
from sim_bridge.simulation.simulation import Simulation


@pytest.fixture(scope="session")
def settings() -> RunSettings:
    """What is driven when nothing is asked for: the default policy."""
    return own_map_settings()


@pytest.fixture(scope="session")
def simulation(settings: RunSettings) -> Simulation:
    """What the simulator node simulates, in this process."""
    road_map = load_map(settings.map_file, settings.origin, settings.projector)
    return SimulationShelf(road_map, settings.route).get(settings.scenario)


@pytest.fixture(scope="session")
def model(simulation: Simulation) -> IntersectionModel:
    return simulation.model


@pytest.fixture(scope="module")
def planner(
    settings: RunSettings, model: IntersectionModel, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[PlannerDriver]:
    """Situation and policy node with the rule-based policy on the four-way crossing."""
    logs = tmp_path_factory.mktemp("planner")
    rule_based = replace(settings, policy="rule_based", scenario="demo_light", supervisor="off")
    commands = rule_based.planner_commands()
    with ros_session("test") as node, NodeGroup(commands, logs) as nodes:
        yield PlannerDriver(node, nodes, model)
