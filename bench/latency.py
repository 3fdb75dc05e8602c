# SPDX-License-Identifier: Apache-2.0
"""What a vehicle waits for: one decision of a network from its file, one situation update."""

import tempfile
from pathlib import Path
from typing import Any

import bench_core
import numpy as np
import torch

from bench.options import Effort
from bench.report import Goal, Section
from bench.timing import Latency, latency
from risk_dqn_planner.policies.base import Policy
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.policies.policy_file import PolicyContract, save_policy
from sim_bridge.environment.place import load_place
from sim_bridge.learning.export import initial_weights, network_of

OBJECTS = (50, 200)
GOAL_SITUATION_MS = 5.0
GOAL_DECISION_MS = 5.0
NOTES = (
    (
        "decide: one situation of 8 vehicles and 4 lanes to an action with its risks; the "
        "network is TorchScript loaded from a policy file with random weights."
    ),
    (
        "situation: from the messages of odometry, objects and visible area (720 corners) to "
        "the message of the situation on four_way; sending and deserialising are not in it."
    ),
    "core: microseconds a situation in batches, the best of several rounds.",
)


def decisions(policy: Policy, repetitions: int) -> Latency:
    """Return how long a policy takes to decide on one situation."""
    scenes = bench_core.drive(1)
    anew = np.zeros(1, dtype=np.bool_)
    count = 0

    def decide() -> None:
        nonlocal count
        policy.decide(scenes[count % len(scenes)], anew)
        count += 1

    return latency(decide, repetitions)


def _policies(folder: Path) -> dict[str, Policy]:
    file = folder / "random.pt"
    save_policy(file, network_of(initial_weights(0)), PolicyContract(name="random"))
    return {"network": load_policy(str(file)), "rule_based": load_policy("rule_based")}


def situations(effort: Effort) -> dict[str, Any]:
    """Return how long a situation update takes by the number of objects.

    Raises ImportError where ROS is not installed: messages are part of it.
    """
    import bench_situation  # noqa: PLC0415 (needs ROS)

    model = load_place("four_way").model
    bench_situation.measure(model, OBJECTS[0], 3, seed=1)
    return {
        f"{count}_objects": bench_situation.summary(
            bench_situation.measure(model, count, effort.situations, seed=1)
        )._asdict()
        for count in OBJECTS
    }


def measure(effort: Effort) -> Section:
    """Measure both, and the core's parts."""
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        decide = {
            name: decisions(policy, effort.decisions)
            for name, policy in _policies(Path(folder)).items()
        }
    missing: dict[str, str] = {}
    updates: dict[str, Any] = {}
    try:
        updates = situations(effort)
    except ImportError as error:
        missing["situation update"] = f"ROS is not in this environment ({error})"
    goals = [
        Goal(
            "inference: decision of a network, p99 [ms]",
            decide["network"].p99_ms,
            GOAL_DECISION_MS,
            at_most=True,
        )
    ]
    if updates:
        median_ms = updates[f"{OBJECTS[0]}_objects"]["p50_ms"]
        name = f"situation update, {OBJECTS[0]} objects, p50 [ms]"
        goals.append(Goal(name, median_ms, GOAL_SITUATION_MS, at_most=True))
    return Section(
        figures={
            "decide": {name: took._asdict() for name, took in decide.items()},
            "situation": updates,
            "core_us_a_situation": bench_core.measure(),
        },
        goals=tuple(goals),
        notes=NOTES,
        missing=missing,
    )
