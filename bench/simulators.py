# SPDX-License-Identifier: Apache-2.0
"""Decision steps a second: our simulator, highway-env's intersection, and a crossing in libsumo."""

import os
from collections.abc import Callable
from contextlib import ExitStack

from bench_simulator import Load, cost_of

from bench.options import Effort
from bench.peers import HighwayEnv, sumo_crossing
from bench.report import Goal, Section
from bench.timing import in_turns, repeat_for
from sim_bridge.environment.place import load_place

BATCH = 1024
OURS, ALONE = f"ours_batch_{BATCH}", "ours_batch_1"
HIGHWAY, SUMO = "highway_env", "libsumo"
GOAL_STEPS_PER_S = 500_000
GOALS = {HIGHWAY: 5_000.0, SUMO: 50.0}
NOTES = (
    (
        "A decision step is half a second of driving. All contestants act at random, and ended"
        " episodes are begun anew, which counts."
    ),
    (
        "ours: four_way, base with 8 other vehicles; traffic, sight past obstacles, matching "
        "of vehicles to lanes, risk of every situation, encoding as the network's input, new "
        "episodes."
    ),
    (
        "highway-env: intersection-v0 at policy_frequency 2 and its own simulation_frequency "
        "15; 10 vehicles at first and more to come, kinematic observation of 15; no occlusion,"
        " no risk; nothing is drawn."
    ),
    (
        "libsumo: four-way crossing with priority, 8 other vehicles, 5 steps of 0.1 s a "
        "decision, the ego's speed set, position, speed and lane of all others read by Python;"
        " no occlusion, no encoding, no risk."
    ),
)


def measure(effort: Effort) -> Section:
    """Let all that are installed take turns."""
    place = load_place("four_way")
    missing: dict[str, str] = {}
    contestants: dict[str, Callable[[], float]] = {
        OURS: lambda: cost_of(place, Load(batch=BATCH)).steps_per_s,
        ALONE: lambda: cost_of(place, Load(batch=1)).steps_per_s,
    }
    why = os.environ.get("PEERS_MISSING", "")
    with ExitStack() as stack:
        try:
            highway = HighwayEnv()
            contestants[HIGHWAY] = lambda: repeat_for(highway.decide, effort.peer_s)
        except ImportError as error:
            missing["highway-env"] = why or str(error)
        try:
            crossing = stack.enter_context(sumo_crossing())
            contestants[SUMO] = lambda: repeat_for(crossing.decide, effort.peer_s)
        except ImportError as error:
            missing["libsumo"] = why or str(error)
        speeds = in_turns(contestants, effort.rounds)
        figures = {f"{name}_steps_per_s": speed for name, speed in speeds.items()}
        if SUMO in speeds:
            figures["libsumo_other_vehicles"] = crossing.observed / crossing.decisions
    return Section(
        figures=figures,
        ratios=tuple(
            Goal(
                f"simulator: ours, batch {batch}, over {peer}",
                speeds[name] / speeds[peer] if peer in speeds else None,
                bound,
            )
            for peer, bound in GOALS.items()
            for batch, name in [(BATCH, OURS)]
        ),
        goals=(Goal(f"simulator: steps/s, batch {BATCH}", speeds[OURS], GOAL_STEPS_PER_S),),
        notes=NOTES,
        missing=missing,
    )
