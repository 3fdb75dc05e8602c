# SPDX-License-Identifier: Apache-2.0
"""The supervisor in the real nodes: it decides as in the simulation, and says what it overruled."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from commands import run
from intersection_msgs.msg import Decision
from rclpy.serialization import deserialize_message

from risk_dqn_planner.decision import Action, Reason
from risk_dqn_planner.map.loader import load_map
from risk_dqn_planner.policies.base import Supervision
from risk_dqn_planner.policies.supervised import SupervisorMode
from risk_dqn_planner.policies.supervised_loading import load_supervised
from risk_dqn_planner.ros.conversions import decision_from_message, to_ns
from sim_bridge.ros import topics
from sim_bridge.ros.building import SimulationShelf
from sim_bridge.ros.recording import read_bag
from sim_bridge.ros.run_settings import own_map_settings

pytestmark = pytest.mark.ros

MAP = "multi_lane"
POLICY = "tuned"
SEED = 7  # an episode in which it is overruled


@dataclass(frozen=True)
class Step:
    """What one decision comes to."""

    action: int
    supervision: int
    proposed: int


def in_the_nodes(folder: Path, *options: str) -> list[Decision]:
    """Drive the episode over DDS and return its decisions."""
    done = run(
        "demo", "--map", MAP, "--episodes", "1", "--seed", str(SEED), "--supervisor", "enforce",
        "--out", str(folder), *options,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    bag = read_bag(folder / "bag", topics.ALL)
    end_ns = bag.of(topics.EPISODE)[1].stamp_ns
    decisions = [deserialize_message(m.data, Decision) for m in bag.of(topics.DECISION)]
    return [d for d in decisions if to_ns(d.header.stamp) < end_ns]


def in_the_simulation() -> list[Step]:
    """Drive the episode in this process."""
    settings = own_map_settings(MAP, POLICY)
    road_map = load_map(settings.map_file, settings.origin, settings.projector)
    simulation = SimulationShelf(road_map, settings.route).get(settings.scenario)
    simulation.reset([SEED])
    supervisor = load_supervised(settings.policy, SupervisorMode.ENFORCE)
    steps, restart = [], np.array([True])
    for _ in range(200):
        decided = supervisor.decide(simulation.situations(), restart)
        assert decided.supervision is not None
        assert decided.proposed is not None
        steps.append(
            Step(int(decided.action[0]), int(decided.supervision[0]), int(decided.proposed[0]))
        )
        result, restart = simulation.step(decided.action), np.array([False])
        if result.terminated[0] or result.truncated[0]:
            break
    return steps


def test_the_nodes_decide_as_the_supervisor_does_in_the_batched_simulation(tmp_path: Path) -> None:
    decisions = in_the_nodes(tmp_path, "--policy", POLICY)
    expected = in_the_simulation()
    assert [Step(d.action, d.supervisor, d.proposed) for d in decisions] == expected
    assert {d.policy_name for d in decisions} == {f"{POLICY}+supervisor"}


def test_what_is_overruled_is_said_with_what_was_proposed(tmp_path: Path) -> None:
    decisions = in_the_nodes(tmp_path, "--policy", "always_fast", "--memory", "tracked")
    assert {d.proposed for d in decisions} == {Decision.FAST}
    verdicts = {Supervision(d.supervisor) for d in decisions}
    assert verdicts == {Supervision.AGREED, Supervision.OVERRULED}
    for decision in map(decision_from_message, decisions):
        overruled = decision.supervision is Supervision.OVERRULED
        assert overruled == (decision.action is not Action.FAST)
        assert overruled == ("supervisor overrules FAST; " in decision.text)
        if overruled:
            assert decision.reason in {Reason.VEHICLE, Reason.HIDDEN_VEHICLE}
            assert decision.critical_lane_id is not None
