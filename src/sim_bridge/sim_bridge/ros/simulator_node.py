# SPDX-License-Identifier: Apache-2.0
"""Simulates the ego and its surroundings for the planner's nodes: a batch of one over topics."""

import queue
import sys
import threading
from typing import NamedTuple

from intersection_msgs.srv import ResetEpisode
from rclpy.node import Node

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.ros.clock import steady_timer
from risk_dqn_planner.ros.declaration import declare
from risk_dqn_planner.ros.main import run
from risk_dqn_planner.ros.parameters import MapParameters
from sim_bridge.ros.building import SimulationShelf
from sim_bridge.ros.episodes import EpisodePlayer
from sim_bridge.ros.input_loss import InputLoss
from sim_bridge.ros.pacing import LockStep, RealTime, WallPace
from sim_bridge.ros.planner_link import PlannerLink
from sim_bridge.ros.publishing import FramePublisher
from sim_bridge.ros.simulator_parameters import SimulatorParameters, declare_route
from sim_bridge.simulation.simulation import Simulation

_WATCH_PERIOD_S = 0.2
_PATIENCE_S = 10.0


class _Request(NamedTuple):
    simulation: Simulation
    seed: int


class SimulatorNode(Node):
    """Owns the clock; plays the episodes that are asked for in a thread of its own."""

    def __init__(self) -> None:
        super().__init__("simulator")
        maps = declare(self, MapParameters)
        self._config = declare(self, SimulatorParameters)
        self._shelf = SimulationShelf(maps.load(), declare_route(self))
        first = self._shelf.get(self._config.scenario)
        loss = declare(self, InputLoss, prefix="loss.")
        self._publisher = FramePublisher(self, maps.map_frame, loss)
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
