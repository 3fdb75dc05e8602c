# SPDX-License-Identifier: Apache-2.0
import json
from pathlib import Path

import numpy as np
import pytest
from intersection_msgs.msg import Decision, EpisodeEvent
from rclpy.serialization import serialize_message
from rich.console import Console

from sim_bridge.ros import topics
from sim_bridge.ros.recording import Stored
from sim_bridge.ros.run_settings import own_map_settings
from sim_bridge.ros.summary import EpisodeResult, episode_result, results_table, run_summary


def result(seed: int, name: str, duration_s: float, mean_mps: float) -> EpisodeResult:
    return EpisodeResult(seed, name, duration_s, mean_mps, {"stop": 1, "slow": 2, "fast": 3}, 0)


@pytest.mark.parametrize(
    ("event", "name"),
    [
        (EpisodeEvent.SUCCESS, "success"),
        (EpisodeEvent.COLLISION, "collision"),
        (EpisodeEvent.TIMEOUT, "timeout"),
    ],
)
def test_an_event_becomes_a_result(event: int, name: str) -> None:
    counts = np.array([4, 5, 6], dtype=np.uint32)
    message = EpisodeEvent(
        seed=2**63, event=event, duration_s=7.5, mean_speed_mps=1.0, action_counts=counts
    )
    found = episode_result(message)
    assert (found.seed, found.result, found.duration_s) == (2**63, name, 7.5)
    assert found.action_counts == {"stop": 4, "slow": 5, "fast": 6}


def test_the_table_weighs_mean_speeds_by_duration() -> None:
    # 10 s at 4 m/s and 30 s at 2 m/s are 100 m in 40 s.
    episodes = [result(0, "success", 10.0, 4.0), result(1, "timeout", 30.0, 2.0)]
    console = Console(width=120)
    with console.capture() as capture:
        console.print(results_table(episodes, "title"))
    totals = capture.get().splitlines()[-2]
    assert "1/2 success" in totals
    assert [cell.strip() for cell in totals.split("│")][3:8] == ["40.0", "2.50", "2", "4", "6"]


def test_the_summary_names_the_policy_as_its_decisions_do(tmp_path: Path) -> None:
    decision = Decision(policy_name="rule_based", policy_hash="ab" * 32)
    messages = [Stored(0, topics.DECISION.name, serialize_message(decision))]
    episodes = [result(3, "success", 10.0, 4.0)]
    run_summary(own_map_settings(), messages, episodes).write(tmp_path / "summary.json")
    written = json.loads((tmp_path / "summary.json").read_text("utf-8"))
    assert written["policy_hash"] == "ab" * 32
    assert written["map"] == "four_way"
    assert written["episodes"][0]["action_counts"] == {"stop": 1, "slow": 2, "fast": 3}
