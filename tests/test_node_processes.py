# SPDX-License-Identifier: Apache-2.0
"""How the nodes' processes start and end, and that they also work in real time."""

import os
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from intersection_msgs.msg import Decision, Situation
from planner_driver import Scene
from rclpy.node import Node

from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY, shipped_policies
from risk_dqn_planner.ros import conversions
from sim_bridge.ros import topics
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.process import NodeCommand, NodeProcess
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.ros.session import wait_until

pytestmark = pytest.mark.ros

PATIENCE_S = 180.0  # where nothing is compiled yet

Start = Callable[[NodeCommand], NodeProcess]


def await_ready(process: NodeProcess) -> None:
    wait_until(lambda: "ready" in process.output(), process.name, PATIENCE_S, process.check)


def await_end(process: NodeProcess) -> int:
    wait_until(
        lambda: process.exit_code is not None,
        f"{process.name} to end: {process.output()}",
        PATIENCE_S,
        lambda: None,
    )
    assert process.exit_code is not None
    return process.exit_code


def complaint(process: NodeProcess) -> str:
    """The last line of a node that must have ended with an error, but not with a traceback."""
    assert await_end(process) == 1
    output = process.output()
    assert "Traceback" not in output, output
    return output.strip().splitlines()[-1]


@pytest.mark.parametrize("request_to_end", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_nodes_that_are_asked_to_end_end_without_an_error(
    start: Start, settings: RunSettings, request_to_end: signal.Signals
) -> None:
    commands = [settings.simulator_command(0.0), *settings.planner_commands()]
    processes = [start(command) for command in commands]
    for process in processes:
        await_ready(process)
    for process in processes:
        os.kill(process.pid, request_to_end)
    for process in processes:
        assert await_end(process) == 0, process.output()
        assert "Traceback" not in process.output(), process.output()


def test_a_simulator_whose_map_cannot_be_read_says_so_and_ends(
    start: Start, settings: RunSettings, tmp_path: Path
) -> None:
    broken = tmp_path / "broken.osm"
    broken.write_text("this is no map")
    wrong = replace(settings, map_file=broken)
    assert "broken.osm is not an OSM file" in complaint(start(wrong.simulator_command(0.0)))


def heard(node: Node, topic: topics.Topic) -> list[Any]:
    """What comes on a topic from now on."""
    messages: list[Any] = []
    node.create_subscription(topic.message, topic.name, messages.append, topic.qos)
    return messages


def test_a_map_that_cannot_be_read_is_told_in_every_situation(
    node: Node, start: Start, settings: RunSettings, tmp_path: Path
) -> None:
    broken = tmp_path / "broken.osm"
    broken.write_text("this is no map")
    situations = heard(node, topics.SITUATION)
    wrong = replace(settings, map_file=broken, overrides={"use_sim_time": False})
    process = start(wrong.planner_commands()[0])
    wait_until(lambda: len(situations) >= 2, "situations", PATIENCE_S, process.check)
    assert {(s.status, s.faulty_input) for s in situations} == {
        (Situation.NOT_CONFIGURED, Situation.MAP)
    }
    assert "broken.osm is not an OSM file" in situations[-1].status_text
    assert "not configured: " in process.output()
    assert "Traceback" not in process.output()


def test_a_simulator_whose_route_does_not_fit_the_map_says_so_and_ends(
    start: Start, settings: RunSettings
) -> None:
    process = start(replace(settings, route=(1, 424242)).simulator_command(0.0))
    assert "lanelet 424242 is not among" in complaint(process)


def test_a_simulator_without_a_route_says_so_and_ends(start: Start, settings: RunSettings) -> None:
    command = settings.simulator_command(0.0)
    parameters = {key: value for key, value in command.parameters.items() if key != "route"}
    assert "parameter route is not set" in complaint(start(replace(command, parameters=parameters)))


def test_a_simulator_with_an_unknown_scenario_names_those_there_are(
    start: Start, settings: RunSettings
) -> None:
    process = start(replace(settings, scenario="rush_hour").simulator_command(0.0))
    assert "there is no scenario 'rush_hour', expected one of: base" in complaint(process)


@pytest.mark.parametrize(
    ("changed", "reason", "words"),
    [
        ({"supervisor": "strict"}, Decision.NOT_CONFIGURED, "expected one of: off, report"),
        (
            {"overrides": {"safety.leader_braking_mps2": 3.0}},
            Decision.NOT_CONFIGURED,
            "leader_braking_mps2 is 3.0, expected at least",
        ),
        ({"policy": "no_such_policy"}, Decision.POLICY_REFUSED, "no_such_policy"),
    ],
    ids=["unknown supervisor", "contradiction", "unknown policy"],
)
@pytest.mark.parametrize("use_sim_time", [True, False], ids=["simulated", "real"])
def test_a_policy_node_that_cannot_be_configured_says_stop_and_why_for_ever(
    node: Node,
    start: Start,
    settings: RunSettings,
    changed: dict[str, Any],
    reason: int,
    words: str,
    use_sim_time: bool,
) -> None:
    decisions = heard(node, topics.DECISION)
    wrong = replace(settings, **changed)
    command = replace(wrong, overrides={**wrong.overrides, "use_sim_time": use_sim_time})
    process = start(command.planner_commands()[1])
    wait_until(
        lambda: [d.reason for d in decisions[-2:]] == [reason] * 2,
        "decisions",
        PATIENCE_S,
        process.check,
    )
    assert {decision.action for decision in decisions} == {Decision.STOP}
    assert words in decisions[-1].text
    assert words in process.output()
    assert "Traceback" not in process.output()


def test_while_the_default_policy_is_loaded_the_ego_is_told_to_stop_and_why(
    node: Node, start: Start
) -> None:
    decisions = heard(node, topics.DECISION)
    remapped = {"~/output/decision": topics.DECISION.name}
    process = start(NodeCommand("risk_dqn_planner", "policy_node", remappings=remapped))
    await_ready(process)
    assert f"ready with policy {DEFAULT_POLICY}" in process.output()
    loading = [d for d in decisions if "still being loaded" in d.text]
    assert loading
    assert {(d.action, d.reason) for d in loading} == {(Decision.STOP, Decision.POLICY_NOT_READY)}
    seen = len(decisions)
    wait_until(lambda: len(decisions) > seen + 1, "decisions", PATIENCE_S, process.check)
    assert decisions[-1].text == "STOP: no situation received yet"
    assert decisions[-1].policy_hash == shipped_policies()[DEFAULT_POLICY].sha256


@pytest.mark.parametrize("request_to_end", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
def test_a_policy_node_can_be_ended_while_it_still_loads(
    node: Node, start: Start, request_to_end: signal.Signals
) -> None:
    decisions = heard(node, topics.DECISION)
    remapped = {"~/output/decision": topics.DECISION.name}
    process = start(NodeCommand("risk_dqn_planner", "policy_node", remappings=remapped))
    wait_until(lambda: bool(decisions), "a decision", PATIENCE_S, process.check)
    os.kill(process.pid, request_to_end)
    assert await_end(process) == 0, process.output()
    assert "Traceback" not in process.output(), process.output()


class WallClockInputs:
    """Publishes a scene ten times a second with stamps of the wall clock."""

    def __init__(self, node: Node, model: IntersectionModel) -> None:
        self._node, self._model = node, model
        self._publishers = {
            topic.name: node.create_publisher(topic.message, topic.name, topic.qos)
            for topic in topics.INPUTS
        }
        route = conversions.route_to_message(model.route, 0)
        self._publishers[topics.ROUTE.name].publish(route)
        self._timer = node.create_timer(0.1, self._publish)

    def _publish(self) -> None:
        # It stays where it is, so it must not say to drive.
        scene, now_ns = Scene(ego_mps=0.4), self._node.get_clock().now().nanoseconds
        for topic, message in (
            (topics.ODOMETRY, scene.odometry(self._model, now_ns)),
            (topics.VISIBLE_AREA, scene.visible_area(self._model, now_ns)),
            (topics.OBJECTS, scene.objects(now_ns)),
        ):
            self._publishers[topic.name].publish(message)

    def stop(self) -> None:
        self._node.destroy_timer(self._timer)


def test_in_real_time_decisions_come_twice_a_second_and_the_ego_stops_when_inputs_do(
    node: Node, settings: RunSettings, model: IntersectionModel, tmp_path: Path
) -> None:
    arrivals: list[tuple[float, Decision]] = []
    node.create_subscription(
        Decision,
        topics.DECISION.name,
        lambda decision: arrivals.append((time.monotonic(), decision)),
        topics.DECISION.qos,
    )

    def newest_action() -> int | None:
        return arrivals[-1][1].action if arrivals else None

    commands = replace(settings, overrides={"use_sim_time": False}).planner_commands()
    with NodeGroup(commands, tmp_path) as nodes:
        inputs = WallClockInputs(node, model)
        wait_until(lambda: newest_action() == Decision.FAST, "FAST", PATIENCE_S, nodes.check)
        first = len(arrivals)
        wait_until(lambda: len(arrivals) >= first + 4, "decisions", PATIENCE_S, nodes.check)
        times = [arrival for arrival, _ in arrivals[first : first + 4]]
        assert times[-1] - times[0] == pytest.approx(1.5, abs=0.3)
        inputs.stop()
        stopped = time.monotonic()
        wait_until(lambda: newest_action() == Decision.STOP, "STOP", PATIENCE_S, nodes.check)
        # At worst the last input is just young enough at one decision and too old at the next.
        assert time.monotonic() - stopped < 1.5
