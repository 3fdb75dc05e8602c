# SPDX-License-Identifier: Apache-2.0
"""Simulates the ego and its surroundings for the planner's nodes: a batch of one over topics."""

import queue
import sys
import threading
from dataclasses import dataclass, field
from typing import NamedTuple

from intersection_msgs.srv import ResetEpisode
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from risk_dqn_planner.errors import ConfigurationError, PlannerError
from risk_dqn_planner.ros.clock import steady_timer
from risk_dqn_planner.ros.main import run
from risk_dqn_planner.ros.parameters import MapParameters, declare
from sim_bridge.ros.building import SimulationShelf
from sim_bridge.ros.episodes import EpisodePlayer
from sim_bridge.ros.pacing import LockStep, PlannerLink, RealTime, WallPace
from sim_bridge.ros.publishing import FramePublisher
from sim_bridge.simulation import Simulation

_WATCH_PERIOD_S = 0.2
_PATIENCE_S = 10.0


@dataclass(frozen=True)
class SimulatorParameters:
    """What is simulated, and how fast."""

    scenario: str = field(
        default="demo_light",
        metadata={"description": "Name of a scenario, or a scenario file ending in .yaml"},
    )
    seed: int = field(
        default=0,
        metadata={
            "description": "Seed of the first episode; the next ones count on",
            "minimum": 0,
            "maximum": 2**31 - 1,
        },
    )
    autostart: bool = field(
        default=True,
        metadata={"description": "Start episodes one after the other without being asked"},
    )
    lockstep: bool = field(
        default=True,
        metadata={
            "description": "Simulated time waits for the planner: the same decisions on every "
            "computer; else the newest decision counts"
        },
    )
    real_time_factor: float = field(
        default=1.0,
        metadata={
            "description": "Highest ratio of simulated to real time; 0 for as fast as possible",
            "minimum": 0.0,
            "maximum": 100.0,
        },
    )
    decision_timeout_s: float = field(
        default=5.0,
        metadata={
            "description": "In lock-step, a decision that takes longer in real time counts as "
            "late and the ego brakes [s]",
            "minimum": 0.01,
            "maximum": 600.0,
        },
    )

    def __post_init__(self) -> None:
        if not self.lockstep and self.real_time_factor == 0.0:
            raise ConfigurationError(
                "parameter real_time_factor is 0 without lockstep, expected a number above 0: "
                "nobody would wait for the planner"
            )


class _Request(NamedTuple):
    simulation: Simulation
    seed: int


class SimulatorNode(Node):
    """Owns the clock; plays the episodes that are asked for in a thread of its own."""

    def __init__(self) -> None:
        super().__init__("simulator")
        maps = declare(self, MapParameters)
        self._config = declare(self, SimulatorParameters)
        self._shelf = SimulationShelf(maps.load(), self._declare_route())
        first = self._shelf.get(self._config.scenario)
        self._publisher = FramePublisher(self, maps.map_frame)
        self._publisher.publish_route(first, 0)
        self._link = PlannerLink(self, "~/input/situation", "~/input/decision")
        self._requests: queue.SimpleQueue[_Request | None] = queue.SimpleQueue()
        self._scenario = self._config.scenario
        if self._config.autostart:
            self._requests.put(_Request(first, self._config.seed))
        self._failure: Exception | None = None
        self.create_service(ResetEpisode, "~/reset", self._on_reset)
        steady_timer(self, _WATCH_PERIOD_S, self._raise_failure)
        self._worker = threading.Thread(target=self._work, name="episodes", daemon=True)
        self._worker.start()
        self.get_logger().info(f"ready on {maps.map_file}")

    def _declare_route(self) -> list[int]:
        name = "route"
        descriptor = ParameterDescriptor(
            description="Lanelets of the ego's route in driving order (required)", read_only=True
        )
        try:
            self.declare_parameter(name, Parameter.Type.INTEGER_ARRAY, descriptor)
            return list(self.get_parameter(name).value)
        except ParameterException as error:
            raise ConfigurationError(
                "parameter route is not set, expected a list of lanelet ids such as [1, 9, 4]"
            ) from error

    def _on_reset(
        self, request: ResetEpisode.Request, response: ResetEpisode.Response
    ) -> ResetEpisode.Response:
        name = request.scenario or self._scenario
        try:
            self._requests.put(_Request(self._shelf.get(name), request.seed))
        except PlannerError as error:
            response.message = str(error)
        else:
            self._scenario = name
            response.success = True
        return response

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise self._failure

    def _go_on(self) -> bool:
        return self._requests.empty() and self.context.ok()

    def _work(self) -> None:
        try:
            self._play_episodes()
        except Exception as error:  # noqa: BLE001 (raised again where the node spins)
            if self.context.ok():
                self._failure = error

    def _play_episodes(self) -> None:
        player = self._player()
        while player is not None and (request := self._requests.get()) is not None:
            player.play(request.simulation, request.seed)
            if self._config.autostart and self._requests.empty():
                self._requests.put(request._replace(seed=request.seed + 1))

    def _player(self) -> EpisodePlayer | None:
        """Return what plays episodes, once the planner is there; None if the node ends before."""
        pace = WallPace(self._config.real_time_factor)
        if not self._config.lockstep:
            return EpisodePlayer(self._publisher, RealTime(self._link, pace), 0, self._go_on)
        while not self._link.closed:
            start_ns = self._link.meet(self._publisher.connected, _PATIENCE_S)
            if start_ns is not None:
                pacing = LockStep(self._link, pace, self._config.decision_timeout_s)
                return EpisodePlayer(self._publisher, pacing, start_ns, self._go_on)
            self.get_logger().info("waiting for the situation and policy nodes")
        return None

    def destroy_node(self) -> None:
        """End the episode, then the node."""
        self._link.close()
        self._requests.put(None)
        self._worker.join(timeout=2.0)
        super().destroy_node()


def main() -> int:
    """Run the node."""
    return run("simulator", SimulatorNode)


if __name__ == "__main__":
    sys.exit(main())
