# SPDX-License-Identifier: Apache-2.0
"""Drives seeded episodes with the real nodes and hands each one over when it has ended."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path

from intersection_msgs.msg import EpisodeEvent
from intersection_msgs.srv import ResetEpisode
from rclpy.client import Client

from risk_dqn_planner.errors import ScenarioError
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.observer import Observer
from sim_bridge.ros.recording import Stored
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.ros.session import ros_session, wait_until
from sim_bridge.ros.topics import RESET_SERVICE

# Loading a map and compiling everything for the first time on a slow computer.
_START_S = 240.0
# Longer than the simulator waits for two late answers.
_SILENCE_S = 30.0


@dataclass(frozen=True)
class DrivenEpisode:
    """The event that ended an episode, and everything said in it, serialised."""

    end: EpisodeEvent
    messages: Sequence[Stored]


def drive(
    settings: RunSettings, seeds: Sequence[int], real_time_factor: float, log_folder: Path
) -> Generator[DrivenEpisode, None, None]:
    """Run one episode for each seed, in three node processes over DDS.

    Raises:
        NodeDiedError: a node ended. EpisodeStuckError: an episode did not. ScenarioError: the
        scenario does not fit the map. SilentPlannerError: the nodes did not find each other.
    """
    commands = [settings.simulator_command(real_time_factor), *settings.planner_commands()]
    with ros_session("demo") as node, NodeGroup(commands, log_folder) as nodes:
        observer = Observer(node)
        reset = node.create_client(ResetEpisode, RESET_SERVICE)
        wait_until(reset.service_is_ready, "the simulator to come up", _START_S, nodes.check)
        wait_until(observer.connected, "the nodes to connect", _START_S, nodes.check)
        for seed in seeds:
            observer.begin()
            _start_episode(reset, settings.scenario, seed, nodes.check)
            end = observer.wait_for_end(_SILENCE_S, nodes.check)
            yield DrivenEpisode(end, observer.episode())


def _start_episode(reset: Client, scenario: str, seed: int, check: Callable[[], None]) -> None:
    answer = reset.call_async(ResetEpisode.Request(scenario=scenario, seed=seed))
    wait_until(answer.done, "the simulator to start an episode", _START_S, check)
    response = answer.result()
    if not response.success:
        raise ScenarioError(response.message)
