# SPDX-License-Identifier: Apache-2.0
"""Plays one episode: publish a frame, let time reach it, obey the decision, step on."""

from collections.abc import Callable

from risk_dqn_planner.decision import Action
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.pacing import Pacing
from sim_bridge.ros.planner_link import DECISION_PERIOD_NS, EPISODE_GAP_NS
from sim_bridge.ros.publishing import FramePublisher
from sim_bridge.simulation.simulation import Simulation, StepResult


class EpisodePlayer:
    """Plays episodes one after the other on a clock that never goes back."""

    def __init__(
        self, publisher: FramePublisher, pacing: Pacing, start_ns: int, go_on: Callable[[], bool]
    ) -> None:
        """Episodes begin at `start_ns`; they are abandoned once `go_on` says no."""
        self._publisher = publisher
        self._pacing = pacing
        self._now_ns = start_ns - EPISODE_GAP_NS
        self._go_on = go_on

    def play(self, simulation: Simulation, seed: int) -> None:
        """Play the episode of a seed until it ends, after a pause that ends the one before."""
        start_ns = self._now_ns + EPISODE_GAP_NS
        start_ns = -(-start_ns // DECISION_PERIOD_NS) * DECISION_PERIOD_NS
        # The route is a new errand; the planner takes note of it while time passes.
        self._publisher.publish_route(simulation, start_ns)
        self._pacing.pause(self._now_ns, start_ns)
        simulation.reset([seed])
        self._now_ns = start_ns
        self._publisher.publish_start(simulation, seed, start_ns)
        self._run(simulation, seed)

    def _run(self, simulation: Simulation, seed: int) -> None:
        step_ns = round(simulation.scenario.timing.inner_step_s * SECOND_NS)
        result: StepResult | None = None
        late = 0
        while self._go_on():
            complete = self._publisher.publish_frame(simulation, seed, self._now_ns)
            self._pacing.reach(self._now_ns, complete=complete)
            decision = self._pacing.decision(self._now_ns)
            if result is not None and (result.terminated[0] or result.truncated[0]):
                self._publisher.publish_end(simulation, seed, self._now_ns, result, late)
                return
            if decision is None and self._now_ns % DECISION_PERIOD_NS == 0:
                late += 1
            result = simulation.inner_step([Action.STOP if decision is None else decision.action])
            self._now_ns += step_ns
