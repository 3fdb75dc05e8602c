# SPDX-License-Identifier: Apache-2.0
"""What the memory of seen space gives: how far the lane that is seen least is known to be free.

Prints the tables of docs/hidden_space.md; to be run as a module.
"""

import sys
from collections.abc import Sequence

import numpy as np

from risk_dqn_planner.decision import Action
from risk_dqn_planner.situation.config import INSTANTANEOUS, TRACKED, TrackingConfig
from sim_bridge.environment.place import Place, load_place
from sim_bridge.environment.seeds import TEST_SEEDS, fixed_seeds
from sim_bridge.evaluation.reporting.markdown import table
from sim_bridge.scenarios.loading import load_scenario

EPISODES = 256
BEFORE_M = (3.0, 0.5)
# Speeds below which hidden vehicles never are; the first column is without memory.
SLOWEST_MPS = (None, 0.0, 1.0, 2.0)
SHOWN = (
    ("four_way", ("close_small_obstacle", "severe_occlusion")),
    ("multi_lane", ("close_small_obstacle",)),
)
_FAST_MPS, _DECISIONS = 5.0, 8


def mean_sight_m(
    place: Place, scenario: str, slowest_mps: float | None, before_m: float, episodes: int
) -> float:
    """Return the mean d_o of the lane that is seen least far, from so far before the stop line.

    By egos that come at 5 m/s and have looked at each decision; without a slowest speed by egos
    without memory.
    """
    tracking = None if slowest_mps is None else TrackingConfig(min_speed_mps=slowest_mps)
    memory = INSTANTANEOUS if tracking is None else TRACKED
    chosen = load_scenario(scenario)
    simulation = place.simulation(chosen, episodes, memory, tracking)
    simulation.reset(fixed_seeds(TEST_SEEDS, episodes))
    egos = simulation.state.episodes
    back_m = before_m + _DECISIONS * _FAST_MPS * chosen.timing.decision_period_s
    egos.ego_s_m[:] += simulation.situations().stop_line_distance_m - back_m
    egos.ego_speed_mps[:] = _FAST_MPS
    # The first look was from where the episode began: what it saw must not count.
    if simulation.tracker is not None:
        simulation.tracker.forget(np.ones(episodes, dtype=np.bool_))
    fast = np.full(episodes, int(Action.FAST))
    for _ in range(_DECISIONS):
        simulation.situations()
        simulation.step(fast)
    situations = simulation.situations()
    there = egos.running
    return float(situations.lane_hidden_distance_m[there].min(axis=1).mean())


def tables(episodes: int = EPISODES) -> str:
    """Return all tables as Markdown."""
    parts = []
    for map_name, scenarios in SHOWN:
        place = load_place(map_name)
        rows = [
            [f"{scenario.replace('_', ' ')}, {before_m:g} m before"]
            + [
                f"{mean_sight_m(place, scenario, slowest, before_m, episodes):.1f}"
                for slowest in SLOWEST_MPS
            ]
            for scenario in scenarios
            for before_m in BEFORE_M
        ]
        parts.append(table([map_name, *map(_column, SLOWEST_MPS)], rows))
    return "\n".join(parts)


def _column(slowest_mps: float | None) -> str:
    if slowest_mps is None:
        return "without"
    return f"v_min = {slowest_mps:g} m/s" if slowest_mps else "tracked"


def main(argv: Sequence[str] | None = None) -> int:
    """Print the tables."""
    if sys.argv[1:] if argv is None else argv:
        print("error: takes no arguments", file=sys.stderr)
        return 2
    print(tables())
    return 0


if __name__ == "__main__":
    sys.exit(main())
