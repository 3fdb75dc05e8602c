# SPDX-License-Identifier: Apache-2.0
"""The demo as users run it: real processes, a bag, a summary, pictures, and nothing left behind."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from commands import run as run_command
from intersection_msgs.msg import Decision, EpisodeEvent, GroundTruth, PerceivedObjects
from rclpy.serialization import deserialize_message

from risk_dqn_planner.decision import Action
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY, shipped_policies
from risk_dqn_planner.ros.conversions import to_ns
from sim_bridge.ros import topics
from sim_bridge.ros.recording import Bag, Stored, read_bag
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.simulation.simulation import Simulation

pytestmark = pytest.mark.ros

EPISODES = 2
SEED = 4


@dataclass(frozen=True)
class Run:
    """What one run of the demo left."""

    folder: Path
    output: str

    def bag(self) -> Bag:
        return read_bag(self.folder / "bag", topics.ALL)


def run_into(folder: Path, episodes: int) -> Run:
    done = run_command(
        "demo", "--episodes", str(episodes), "--seed", str(SEED), "--out", str(folder)
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return Run(folder, done.stdout)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return run_into(tmp_path_factory.mktemp("demo"), EPISODES)


def decisions_of(bag: Bag) -> list[Decision]:
    return [deserialize_message(stored.data, Decision) for stored in bag.of(topics.DECISION)]


def texts(stored: Sequence[Stored], topic: topics.Topic) -> list[str]:
    """Messages as text: equal bytes they need not have, as serialisation leaves gaps undefined."""
    return [str(deserialize_message(message.data, topic.message)) for message in stored]


def test_the_summary_says_what_was_driven_and_how_it_went(run: Run, settings: RunSettings) -> None:
    summary = json.loads((run.folder / "summary.json").read_text("utf-8"))
    assert summary["map"] == "four_way"
    assert summary["route"] == list(settings.route)
    assert summary["policy"] == DEFAULT_POLICY
    assert summary["policy_hash"] == shipped_policies()[DEFAULT_POLICY].sha256
    assert [episode["seed"] for episode in summary["episodes"]] == [SEED, SEED + 1]
    for episode in summary["episodes"]:
        assert episode["result"] in {"success", "timeout"}
        assert episode["late_decisions"] == 0
        steps = sum(episode["action_counts"].values())
        # The last decision step may end early, at the goal.
        assert 0.0 <= 0.5 * steps - episode["duration_s"] < 0.5


def test_the_table_shows_every_episode(run: Run) -> None:
    for seed in (SEED, SEED + 1):
        assert f"seed {seed}" in run.output
    assert f"/{EPISODES} success" in run.output


def test_there_is_a_picture_of_every_episode(run: Run) -> None:
    for seed in (SEED, SEED + 1):
        picture = (run.folder / f"episode_{seed}.png").read_bytes()
        assert picture.startswith(b"\x89PNG")
        assert len(picture) > 10_000


def test_the_bag_holds_every_frame_of_every_topic(run: Run) -> None:
    bag = run.bag()
    ends = [deserialize_message(m.data, EpisodeEvent) for m in bag.of(topics.EPISODE)][1::2]
    frames = sum(round(end.duration_s / 0.1) + 1 for end in ends)
    for topic in (*topics.INPUTS[1:], topics.SITUATION, topics.GROUND_TRUTH):
        assert len(bag.of(topic)) == frames, topic.name
    assert len(bag.of(topics.ROUTE)) == EPISODES


def test_hidden_vehicles_are_absent_from_what_the_planner_perceives(run: Run) -> None:
    bag = run.bag()
    perceived = {
        stored.stamp_ns: {o.id for o in deserialize_message(stored.data, PerceivedObjects).objects}
        for stored in bag.of(topics.OBJECTS)
    }
    hidden_ever = seen_ever = 0
    for stored in bag.of(topics.GROUND_TRUTH):
        vehicles = deserialize_message(stored.data, GroundTruth).vehicles
        hidden = {vehicle.id for vehicle in vehicles if vehicle.hidden}
        seen = {vehicle.id for vehicle in vehicles if not vehicle.hidden}
        assert perceived[stored.stamp_ns] == seen
        hidden_ever, seen_ever = hidden_ever + len(hidden), seen_ever + len(seen)
    assert hidden_ever > 0
    assert seen_ever > 0


def test_the_same_seed_gives_the_same_decisions_and_inputs_again(run: Run, tmp_path: Path) -> None:
    again = run_into(tmp_path / "again", 1).bag()
    until_ns = again.messages[-1].stamp_ns
    for topic in (*topics.INPUTS, topics.SITUATION, topics.DECISION):
        first = [m for m in run.bag().of(topic) if m.stamp_ns <= until_ns]
        assert texts(again.of(topic), topic) == texts(first, topic), topic.name


def test_the_nodes_decide_as_the_policy_does_in_the_batched_simulation(
    run: Run, simulation: Simulation, settings: RunSettings
) -> None:
    simulation.reset([SEED])
    policy = load_policy(settings.policy)
    expected, restart = [], np.array([True])
    for _ in range(200):
        decided = policy.decide(simulation.situations(), restart)
        expected.append(Action(decided.action[0]))
        result, restart = simulation.step(decided.action), np.array([False])
        if result.terminated[0] or result.truncated[0]:
            break
    end_ns = run.bag().of(topics.EPISODE)[1].stamp_ns
    decisions = [d for d in decisions_of(run.bag()) if to_ns(d.header.stamp) < end_ns]
    assert [Action(decision.action) for decision in decisions] == expected
