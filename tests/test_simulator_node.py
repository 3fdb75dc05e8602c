# SPDX-License-Identifier: Apache-2.0
"""The simulator's real node by itself, in real time: resets, the clock, and whom it obeys."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from intersection_msgs.msg import Decision, EpisodeEvent, GroundTruth
from intersection_msgs.srv import ResetEpisode
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from risk_dqn_planner.ros.conversions import header, to_ns
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros import topics
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.ros.session import ros_session, wait_until

pytestmark = pytest.mark.ros

PATIENCE_S = 120.0
RATE = 20.0


class Watcher:
    """Collects what the simulator says, and decides FAST for it while it is asked to."""

    def __init__(self, node: Node, nodes: NodeGroup) -> None:
        self._nodes = nodes
        self.events: list[EpisodeEvent] = []
        self.truths: list[GroundTruth] = []
        self.clock_ns: list[int] = []
        self.deciding = False
        deep = 1000
        node.create_subscription(EpisodeEvent, topics.EPISODE.name, self.events.append, deep)
        node.create_subscription(GroundTruth, topics.GROUND_TRUTH.name, self.truths.append, deep)
        node.create_subscription(Clock, "/clock", self._on_clock, deep)
        self._decisions = node.create_publisher(Decision, topics.DECISION.name, 1)
        self._reset = node.create_client(ResetEpisode, topics.RESET_SERVICE)
        wait_until(self._reset.service_is_ready, "the simulator", PATIENCE_S, nodes.check)

    def _on_clock(self, message: Clock) -> None:
        self.clock_ns.append(to_ns(message.clock))
        if self.deciding:
            decision = Decision(header=header(self.clock_ns[-1]), action=Decision.FAST)
            self._decisions.publish(decision)

    def reset(self, seed: int, scenario: str = "") -> ResetEpisode.Response:
        answer = self._reset.call_async(ResetEpisode.Request(seed=seed, scenario=scenario))
        wait_until(answer.done, "the answer", PATIENCE_S, self._nodes.check)
        response: ResetEpisode.Response = answer.result()  # type: ignore[no-untyped-call]
        return response

    def await_event(self, event: int, seed: int) -> EpisodeEvent:
        def found() -> list[EpisodeEvent]:
            return [e for e in self.events if e.event == event and e.seed == seed]

        wait_until(lambda: bool(found()), f"event {event}", PATIENCE_S, self._nodes.check)
        return found()[-1]

    def await_ego(self, seed: int, least_mps: float, most_mps: float) -> GroundTruth:
        def newest() -> GroundTruth | None:
            ours = [truth for truth in self.truths if truth.seed == seed]
            return ours[-1] if ours else None

        def holds() -> bool:
            truth = newest()
            return truth is not None and least_mps <= truth.ego.speed_mps <= most_mps

        wait_until(holds, f"{least_mps} to {most_mps} m/s", PATIENCE_S, self._nodes.check)
        truth = newest()
        assert truth is not None
        return truth


@pytest.fixture(scope="module")
def watcher(settings: RunSettings, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watcher]:
    command = settings.simulator_command(RATE)
    real_time = replace(command, parameters={**command.parameters, "lockstep": False})
    logs = tmp_path_factory.mktemp("simulator")
    with ros_session("test") as node, NodeGroup([real_time], logs) as nodes:
        yield Watcher(node, nodes)


def test_without_a_planner_the_ego_brakes_and_the_episode_times_out(watcher: Watcher) -> None:
    assert watcher.reset(seed=11).success
    started = watcher.await_event(EpisodeEvent.STARTED, seed=11)
    ended = watcher.await_event(EpisodeEvent.TIMEOUT, seed=11)
    assert ended.duration_s == pytest.approx(60.0)
    assert to_ns(ended.header.stamp) - to_ns(started.header.stamp) == 60 * SECOND_NS
    assert list(ended.action_counts) == [120, 0, 0]
    assert ended.late_decisions == 120
    assert watcher.await_ego(11, 0.0, 0.0).ego.speed_mps == 0.0


def test_the_ego_obeys_the_newest_decision_and_brakes_when_it_is_a_second_old(
    watcher: Watcher,
) -> None:
    watcher.deciding = True
    assert watcher.reset(seed=12).success
    watcher.await_ego(12, 4.9, 5.0)
    watcher.deciding = False
    watcher.await_ego(12, 0.0, 0.0)


def test_a_reset_abandons_the_episode_and_simulated_time_never_goes_back(watcher: Watcher) -> None:
    assert watcher.reset(seed=13).success
    watcher.await_event(EpisodeEvent.STARTED, seed=13)
    assert watcher.reset(seed=14, scenario="dense_traffic").success
    started = watcher.await_event(EpisodeEvent.STARTED, seed=14)
    assert started.scenario == "dense_traffic"
    ended = [e for e in watcher.events if e.seed == 13 and e.event != EpisodeEvent.STARTED]
    assert ended == []
    assert watcher.clock_ns == sorted(watcher.clock_ns)
    assert to_ns(started.header.stamp) % (SECOND_NS // 2) == 0


def test_an_unknown_scenario_is_refused_and_named(watcher: Watcher) -> None:
    response = watcher.reset(seed=15, scenario="rush_hour")
    assert not response.success
    assert "there is no scenario 'rush_hour'" in response.message
    assert [event for event in watcher.events if event.seed == 15] == []
