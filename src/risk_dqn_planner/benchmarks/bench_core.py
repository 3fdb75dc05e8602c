# SPDX-License-Identifier: Apache-2.0
"""Time per situation of risk, state and rule, with 8 vehicles and 4 lanes, and of a decision.

Run as `python benchmarks/bench_core.py`. Of the parts the best of several rounds counts, first
calls (which compile) do not. A decision is what the policy node takes for one situation with 50
vehicles: network or search, supervisor and words; its percentiles are over single decisions of
many egos.
"""

import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

from risk_dqn_planner.decision import explain
from risk_dqn_planner.policies.base import Policy
from risk_dqn_planner.policies.rule_based import RuleBasedPolicy
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY
from risk_dqn_planner.policies.supervised import SupervisorMode
from risk_dqn_planner.policies.supervised_loading import load_supervised
from risk_dqn_planner.risk.risk import RiskConfig, assess
from risk_dqn_planner.situation.situations import Situations, empty_situations
from risk_dqn_planner.state.history import StateEncoder

VEHICLES, LANES, STEPS, ROUNDS = 8, 4, 5, 30
MANY_VEHICLES, EGOS, DECISIONS, FIRST_DECISIONS = 50, 100, 5000, 100
LOOK_AHEAD = "look_ahead"
DECIDERS = (
    *((DEFAULT_POLICY, mode) for mode in SupervisorMode),
    (LOOK_AHEAD, SupervisorMode.OFF),
    (LOOK_AHEAD, SupervisorMode.ENFORCE),
)


def drive(batch: int, vehicles: int = VEHICLES) -> list[Situations]:
    """Situations of a few decision steps: everyone keeps the speed."""
    rng = np.random.default_rng(0)
    s = empty_situations(batch, vehicles, LANES)
    n, m = (batch, vehicles), (batch, LANES)
    s.stop_line_distance_m[:] = rng.uniform(-10.0, 40.0, batch)
    s.goal_distance_m[:] = s.stop_line_distance_m + 22.0
    s.ego_speed_mps[:] = rng.uniform(0.0, 5.0, batch)
    s.vehicle_mask[:] = True
    s.vehicle_id[:] = np.arange(vehicles)
    s.vehicle_lane[:] = rng.integers(0, LANES, n)
    s.vehicle_distance_m[:] = rng.uniform(-5.0, 70.0, n)
    s.vehicle_speed_mps[:] = rng.uniform(0.0, 8.0, n)
    s.lane_mask[:] = True
    s.lane_id[:] = np.arange(LANES)
    s.lane_ego_distance_m[:] = s.stop_line_distance_m[:, None] + 5.5 + 3.5 * np.arange(LANES)
    s.lane_hidden_distance_m[:] = rng.uniform(5.0, 70.0, m)
    s.lane_speed_limit_mps[:] = 7.0
    s.lane_ego_zone_m[:] = 6.0
    s.lane_zone_m[:] = 6.0
    period_s = 0.5
    return [
        s._replace(
            stop_line_distance_m=s.stop_line_distance_m - travel,
            goal_distance_m=s.goal_distance_m - travel,
            lane_ego_distance_m=s.lane_ego_distance_m - travel[:, None],
            vehicle_distance_m=s.vehicle_distance_m - step * period_s * s.vehicle_speed_mps,
        )
        for step in range(STEPS)
        for travel in [step * period_s * s.ego_speed_mps]
    ]


def microseconds(work: Callable[[Situations], object], scenes: list[Situations]) -> float:
    """Time of one situation, the best of several rounds over the scenes."""
    batch = len(scenes[0].ego_speed_mps)
    repeats = max(1, 200 // batch)
    best_s = float("inf")
    for _ in range(ROUNDS + 1):
        begin_s = time.perf_counter()
        for _ in range(repeats):
            for scene in scenes:
                work(scene)
        best_s = min(best_s, time.perf_counter() - begin_s)
    return best_s / (repeats * len(scenes) * batch) * 1e6


def measure(batches: Sequence[int] = (1, 1024)) -> dict[str, dict[str, float]]:
    """Return the microseconds a situation of each part, by batch size."""
    scenes = {batch: drive(batch) for batch in batches}
    none = {batch: np.zeros(batch, dtype=bool) for batch in scenes}
    risk, rule = RiskConfig(), RuleBasedPolicy()
    encoders = {batch: StateEncoder() for batch in scenes}
    states = {batch: np.empty((batch, 5, 3, 8), dtype=np.float32) for batch in scenes}
    works: dict[str, Callable[[int], Callable[[Situations], object]]] = {
        "assess": lambda _: lambda s: assess(s, risk, include_hidden=True),
        "encode": lambda b: lambda s: encoders[b].encode(s, none[b], states[b]),
        "rule_based": lambda b: lambda s: rule.decide(s, none[b]),
    }
    return {
        name: {f"batch_{batch}": microseconds(work(batch), scenes[batch]) for batch in scenes}
        for name, work in works.items()
    }


def decision_ms(policy: Policy, decisions: int = DECISIONS) -> dict[str, float]:
    """Return how long one decision with its words takes: median, p99 and most [ms]."""
    steps, times_ms = drive(EGOS, MANY_VEHICLES), []
    scenes = [
        Situations._make(field[ego : ego + 1] for field in step)
        for ego in range(EGOS)
        for step in steps
    ]
    for count in range(FIRST_DECISIONS + decisions):
        scene = scenes[count % len(scenes)]
        begin_s = time.perf_counter()
        explain(policy.decide(scene, np.array([count % STEPS == 0])), scene, 0, policy)
        times_ms.append(1e3 * (time.perf_counter() - begin_s))
    counted = np.array(times_ms[FIRST_DECISIONS:])
    p50, p99 = np.percentile(counted, (50, 99))
    return {"p50": float(p50), "p99": float(p99), "most": float(counted.max())}


def print_decisions() -> None:
    """Print how long decisions take, of the default policy and of the search."""
    sys.stdout.write(f"\n{'ms per decision':<24}{'p50':>12}{'p99':>12}{'most':>12}\n")
    for name, mode in DECIDERS:
        found = decision_ms(load_supervised(name, mode))
        row = "".join(f"{value:>12.3f}" for value in found.values())
        sys.stdout.write(f"{f'{name}, {mode.value}':<24}{row}\n")


def main() -> None:
    """Print all measurements."""
    found = measure()
    heads = "".join(f"{name:>12}" for name in found["assess"])
    sys.stdout.write(f"{'us per situation':<24}{heads}\n")
    for part, times in found.items():
        row = "".join(f"{value:>12.3f}" for value in times.values())
        sys.stdout.write(f"{part:<24}{row}\n")
    print_decisions()


if __name__ == "__main__":
    main()
