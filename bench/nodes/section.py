# SPDX-License-Identifier: Apache-2.0
"""What a vehicle waits for, with everything in between: a Section of the benchmark."""

import tempfile
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from bench.nodes import answering, driving
from bench.nodes.cores import all_cores, bound_to
from bench.nodes.listening import Spread, typical
from bench.options import Effort
from bench.progress import say
from bench.report import Goal, Section
from risk_dqn_planner.intersection.model import IntersectionModel
from sim_bridge.environment.place import load_place
from sim_bridge.ros.run_settings import own_map_settings

OBJECTS = (50, 200)
GOAL_SITUATION_MS = {50: 10.0, 200: 25.0}
GOAL_UNEVEN_MS = 20.0
GOAL_DECISION_MS = 5.0

# Drives by name: number of objects, and which cores are kept busy beside the nodes.
UNDISTURBED, LOADED_CORE, ALL_LOADED = "undisturbed", "loaded core", "all cores loaded"
DRIVES = (
    (50, UNDISTURBED),
    (200, UNDISTURBED),
    (50, LOADED_CORE),
    (50, ALL_LOADED),
)
# Policies and what their supervisor does.
POLICIES = (
    ("sound_dqn", "off"),
    ("tuned", "off"),
    ("tuned", "report"),
    ("tuned", "enforce"),
    ("rule_based", "off"),
    ("fastest_sound", "off"),
    ("look_ahead", "off"),
)
NOTES = (
    (
        "situation: 720 corners, ten times a second in real time; from before publishing the "
        "first of odometry, visible area and objects until the situation of that stamp arrives"
    ),
    (
        "unevenness: how far the time between the arrivals of two decisions is from 0.5 s, policy "
        f"tuned with supervisor; {LOADED_CORE}: situation node, policy node and a process that "
        f"never waits are bound to one core; {ALL_LOADED}: one such process is bound to each core, "
        "nothing else is bound"
    ),
    (
        "decision: in simulated time, from before publishing a situation of 50 objects until the "
        "decision arrives, which is due already and lacks only that situation; medians of rounds"
    ),
    "computed: processor time of a node for each set of inputs, its timers included",
)


def measure(effort: Effort) -> Section:
    """Measure both; the nodes run on all cores unless the load says otherwise."""
    model = load_place("four_way").model
    with tempfile.TemporaryDirectory() as folder, bound_to(all_cores()):
        logs = Path(folder)
        drives = {
            f"{objects} objects, {load}": drive_under(load, model, objects, effort, logs)
            for objects, load in DRIVES
        }
        asked = answering.situations(model, OBJECTS[0], effort.node_decisions)
        took = decisions_of(asked, effort.node_rounds, logs)
        plain = typical([answering.plain_work(len(asked)) for _ in range(effort.node_rounds)])
    figures: dict[str, Any] = {
        "drives": {name: asdict(found) for name, found in drives.items()},
        "decision": {name: found._asdict() for name, found in took.items()},
        "plain_work": plain._asdict(),
    }
    for found in figures["drives"].values():
        found.update({key: found[key]._asdict() for key in ("situation", "uneven")})
    return Section(figures=figures, goals=goals(drives, took), notes=NOTES)


def decisions_of(asked: list[bytes], rounds: int, logs: Path) -> dict[str, Spread]:
    """Return how long each policy's decisions take; policies take turns, round by round."""
    found: dict[str, list[Spread]] = {}
    for _ in range(rounds):
        for policy, supervisor in POLICIES:
            settings = own_map_settings(policy=policy, supervisor=supervisor)
            name = policy if supervisor == "off" else f"{policy}, supervisor {supervisor}"
            took = answering.answers(settings, asked, logs)
            found.setdefault(name, []).append(took)
            say(f"decision of {name}: p99 {took.p99_ms:.2f} ms")
    return {name: typical(each) for name, each in found.items()}


def drive_under(
    load: str, model: IntersectionModel, objects: int, effort: Effort, logs: Path
) -> driving.Drive:
    """Return what came of a drive beside such a load."""
    cores = all_cores()
    one = frozenset({max(cores)})
    # Whoever measures stays off the loaded core, where there is another one.
    where = {
        UNDISTURBED: driving.Cores(own=cores, nodes=cores, busy=frozenset()),
        LOADED_CORE: driving.Cores(own=cores - one or cores, nodes=one, busy=one),
        ALL_LOADED: driving.Cores(own=cores, nodes=cores, busy=cores),
    }
    found = driving.drive(own_map_settings(), model, objects, effort.drive_s, where[load], logs)
    say(
        f"{objects} objects, {load}: situation p99 {found.situation.p99_ms:.2f} ms, decisions "
        f"uneven by p99 {found.uneven.p99_ms:.2f} ms"
    )
    return found


def goals(drives: Mapping[str, driving.Drive], took: Mapping[str, Spread]) -> tuple[Goal, ...]:
    """Return what is asked of these figures."""
    found = [
        Goal(
            f"objects in to situation out, {objects} objects, p99 [ms]",
            drives[f"{objects} objects, {UNDISTURBED}"].situation.p99_ms,
            GOAL_SITUATION_MS[objects],
            at_most=True,
        )
        for objects in OBJECTS
    ]
    found += [
        Goal(
            f"decisions at 2 Hz, {load}, uneven by, p99 [ms]",
            drives[f"{OBJECTS[0]} objects, {load}"].uneven.p99_ms,
            GOAL_UNEVEN_MS,
            at_most=True,
        )
        for load in (LOADED_CORE, ALL_LOADED)
    ]
    found += [
        Goal(f"decision, {name}, p99 [ms]", each.p99_ms, GOAL_DECISION_MS, at_most=True)
        for name, each in took.items()
    ]
    return tuple(found)
