# SPDX-License-Identifier: Apache-2.0
"""What the benchmark of the nodes computes, and that its traffic is beyond doubt."""

from pathlib import Path

import numpy as np
import pytest
from intersection_msgs.msg import Situation
from rclpy.serialization import deserialize_message, serialize_message

import bench  # noqa: F401 (finds the packages' own benchmarks)
from bench.nodes.answering import restamped
from bench.nodes.listening import Spread, spread, typical, uneven
from bench.nodes.page import write_page
from bench.nodes.scene import MovingScene, perception
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.situation.plausibility import Plausibility


def test_unevenness_is_how_far_intervals_are_from_the_period() -> None:
    assert uneven([0.0, 0.5, 1.02, 1.5], 0.5) == pytest.approx([0.0, 20.0, 20.0])


def test_a_spread_of_one_to_a_hundred() -> None:
    found = spread([float(k) for k in range(1, 101)])
    assert found == pytest.approx((100, 50.5, 99.01, 100.0))


def test_what_is_typical_is_the_median_of_the_rounds() -> None:
    rounds = [Spread(10, 3.0, 5.0, 6.0), Spread(9, 3.5, 11.0, 16.0), Spread(10, 2.0, 4.0, 5.0)]
    assert typical(rounds) == (29, 3.0, 5.0, 16.0)


def test_a_spread_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="nothing was timed"):
        spread([])


def test_a_message_with_another_stamp_is_the_same_otherwise() -> None:
    message = Situation(header=conversions.header(1_500_000_000, "map"), route=[1, 9, 4])
    other = deserialize_message(restamped(serialize_message(message), 7_250_000_000), Situation)
    assert conversions.to_ns(other.header.stamp) == 7_250_000_000
    other.header.stamp = message.header.stamp
    assert other == message


def test_nothing_in_the_moving_scene_is_implausible(model: IntersectionModel) -> None:
    scene, checks = MovingScene(model, 200, duration_s=20.0, seed=1), Plausibility()
    places = []
    for k in range(200):
        stamp_ns = k * 100_000_000
        inputs = scene.inputs(0.1 * k, stamp_ns)
        seen = perception(inputs)
        checks.check(seen, 0.1 * k, 0.1 * k)
        places.append((seen.ego.x_m, seen.ego.y_m))
    assert np.hypot(*np.subtract(places[-1], places[0])) > 10.0


def test_the_page_says_what_was_measured_and_which_goal_was_missed(tmp_path: Path) -> None:
    took = {"timed": 100, "p50_ms": 4.0, "p99_ms": 8.25, "max_ms": 9.0}
    drive = {"situation": took, "uneven": took, "late": 0, "doubtful": 0,
             "computed_ms": {"situation_node": 5.0, "policy_node": 2.0}}  # fmt: skip
    measured = {
        "machine": {"processor": "P", "cores": 2, "system": "S", "load_average_at_start": 0.1,
                    "begun": "2026-01-02T03:04:05+00:00"},
        "versions": {"python": "3.12.3", "git_revision": "abcdef0123456789"},
        "figures": {"nodes": {"drives": {"50 objects, undisturbed": drive},
                              "decision": {"tuned": took}, "plain_work": took}},
        "goals": {"decision, tuned, p99 [ms]": {"value": 8.25, "goal": {"at_most": 5.0},
                                                "reached": False}},
    }  # fmt: skip
    node = {
        "memory_mb": {"after_warm_up": 400.0, "end": 401.0, "slope_per_h": 0.5},
        "threads": {"after_warm_up": 14, "end": 14},
        "open_files": {"after_warm_up": 18, "end": 18},
    }
    soak = {
        "passed": True, "complaints": [], "simulated_h": 1.0, "wall_s": 600.0,
        "real_time_factor": 6.0, "episodes": {"success": 200}, "decisions": 7000,
        "longest_gap_s": 0.5, "late_decisions": 0, "processes": {"policy_node": node},
        "limits": {"warm_up": 0.2, "growth_mb": 5.0, "ratio": 1.05, "longest_gap_s": 1.0},
    }  # fmt: skip
    (tmp_path / "memory.png").write_bytes(b"picture")
    write_page(measured, soak, tmp_path / "memory.png", tmp_path / "timing.md")
    text = (tmp_path / "timing.md").read_text()
    assert "| tuned | 4.0 | 8.2 | 9.0 | 100 |" in text
    assert "| plain Python | 4.0 | 8.2 | 9.0 | 100 |" in text
    assert "| decision, tuned, p99 [ms] | 8.2 | 5 | **missed** |" in text
    assert "| policy_node | 400.0 | 401.0 | +0.50 | 14 / 14 | 18 / 18 |" in text
    assert (tmp_path / "images" / "soak.png").read_bytes() == b"picture"
