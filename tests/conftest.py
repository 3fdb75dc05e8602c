# SPDX-License-Identifier: Apache-2.0
"""Real node processes for tests, each group in a ROS domain of its own."""

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from planner_driver import PlannerDriver
from rclpy.node import Node

from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import load_map
from sim_bridge.ros.building import SimulationShelf
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.process import NodeCommand, NodeProcess
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


@pytest.fixture
def node() -> Iterator[Node]:
    """A node that listens in a ROS domain of its own."""
    with ros_session("test") as session_node:
        yield session_node


@pytest.fixture
def start(node: Node, tmp_path: Path) -> Iterator[Callable[[NodeCommand], NodeProcess]]:
    """Starts processes in the domain of `node`, which end with the test."""
    assert node.context.ok()  # before it, there is no domain to inherit
    started: list[NodeProcess] = []

    def start_one(command: NodeCommand) -> NodeProcess:
        log = tmp_path / f"{len(started)}_{command.executable}.log"
        started.append(NodeProcess(command, log))
        return started[-1]

    yield start_one
    for process in started:
        process.interrupt()
    for process in started:
        process.stop()


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
