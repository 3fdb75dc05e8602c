# SPDX-License-Identifier: Apache-2.0
"""Evaluates policies in every situation of the paper's figures, on the same episodes each.

Writes results.json and the paper's four figures into the output folder. Interrupted, the same
command goes on where it was. The set soundness takes hours (--episodes says how many): commands for
single maps may run side by side into one folder, then one for all puts their cells together.
Exit code: 0 done, 2 an option is no good, 130 interrupted.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from risk_dqn_planner.errors import ConfigurationError, PlannerError
from risk_dqn_planner.policies.shipped import shipped_policies
from sim_bridge.environment.place import Places
from sim_bridge.evaluation.campaign import (
    Campaign,
    entries_in_sight,
    has_optimum,
    versions,
)
from sim_bridge.evaluation.cells import Cell, cells_of, paper_cells
from sim_bridge.evaluation.contestants import DEFAULT_POLICIES, contestants, named_policies
from sim_bridge.evaluation.progress import progress_on
from sim_bridge.evaluation.reporting.markdown import entries_told
from sim_bridge.evaluation.rollout import Contestant
from sim_bridge.evaluation.soundness.cells import MAPS, POLICIES, UNAIDED
from sim_bridge.evaluation.soundness.evaluate import (
    EPISODES,
    LIMIT_EPISODES,
    SEARCH_EPISODES,
    Plan,
    run,
)
from sim_bridge.evaluation.store import Store, write_whole
from sim_bridge.evaluation.training_runs import RUN_FOLDERS, named_runs, training_runs
from sim_bridge.folders import require_writable, writing_to
from sim_bridge.maps import add_map_file_options, map_names, route_and_origin
from sim_bridge.threads import compute_on_one_thread

RESULTS = "results.json"
INTERRUPTED = 130
PAPER, SOUNDNESS = "paper", "soundness"
SETS = (PAPER, SOUNDNESS)
PAPER_EPISODES, PAPER_MAP = 2000, "four_way"
_FOLDERS = {PAPER: Path("out/evaluation"), SOUNDNESS: Path("out/soundness")}


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="evaluate", description=__doc__)
    add = parser.add_argument
    add("--set", choices=SETS, default=PAPER, help="which cells [%(default)s]")
    defaults = f"{PAPER_EPISODES}; {SOUNDNESS} {EPISODES}"
    add("--episodes", type=int, help=f"in each cell [{defaults}]")
    add(
        "--search-episodes",
        type=int,
        default=SEARCH_EPISODES,
        help=f"of them, those that look_ahead drives ({SOUNDNESS}) [%(default)s]",
    )
    add(
        "--sound-episodes",
        type=int,
        help=f"that {' and '.join(UNAIDED)} drive where they may not collide ({SOUNDNESS}) "
        "[as --episodes]",
    )
    add(
        "--limit-episodes",
        type=int,
        default=LIMIT_EPISODES,
        help=f"of them, those whose limits are searched ({SOUNDNESS}) [%(default)s]",
    )
    add(
        "--policies",
        help="names, policy files (* allowed) or module:factory, by commas "
        f"[{','.join(DEFAULT_POLICIES)}; {SOUNDNESS} {','.join(POLICIES)}]",
    )
    add("--scenarios", help="names or .yaml files instead of the set's cells, by commas")
    maps = ", ".join(map_names())
    add(
        "--map",
        help=f"own map ({maps}) or an .osm file [{PAPER_MAP}; {SOUNDNESS} {','.join(MAPS)}]",
    )
    add_map_file_options(parser)
    add(
        "--training",
        type=Path,
        nargs="*",
        default=RUN_FOLDERS,
        help=f"folders of training runs [{' '.join(map(str, RUN_FOLDERS))}]",
    )
    add("--output", type=Path, help="folder [out/evaluation; out/soundness]")
    add(
        "--report", type=Path, help="also write this page, its pictures to images/results beside it"
    )
    return parser.parse_args(argv)


def _places(arguments: argparse.Namespace) -> Places:
    route, origin = route_and_origin(arguments.route, arguments.origin)
    return Places.named(arguments.map or PAPER_MAP, route, origin, arguments.projector)


def _run(
    campaign: Campaign,
    drivers: list[Contestant],
    cells: list[Cell],
    console: Console,
    results: list[dict[str, Any]],
) -> None:
    """Append the results of all drivers in all cells, showing how far it is."""
    with progress_on(console) as progress:
        task = progress.add_task("", total=len(drivers) * len(cells) * campaign.episodes)
        for driver in drivers:
            reason = has_optimum(driver, campaign.places, cells[0])
            if reason:
                console.print(f"{driver.name} is left out: {reason}")
                progress.advance(task, len(cells) * campaign.episodes)
                continue
            for cell in cells:
                label = f"{_called(driver)} {cell.scenario} {cell.traffic}"
                progress.update(task, description=label)
                results.append(
                    campaign.result(driver, cell, lambda count: progress.advance(task, count))
                )


def _called(driver: Contestant) -> str:
    seed = driver.training_seed
    return driver.name if seed is None else f"{driver.name} seed {seed}"


def _write(folder: Path, head: dict[str, Any], results: list[dict[str, Any]]) -> None:
    write_whole(folder / RESULTS, json.dumps({"versions": head, "cells": results}, indent=1) + "\n")


def _overview(results: list[dict[str, Any]]) -> Table:
    table = Table(title="success / collision / timeout in %, mean speed in m/s")
    for name in ("policy", "scenario", "traffic", "range", "S / C / T", "speed"):
        table.add_column(name, no_wrap=name in ("range", "S / C / T", "speed"), overflow="fold")
    for result in results:
        rates = (100.0 * result[key]["rate"] for key in ("success", "collision", "timeout"))
        table.add_row(
            result["policy"],
            result["scenario"],
            result["traffic"],
            f"{result['sensor_range_m']:g} m",
            " / ".join(f"{rate:.1f}" for rate in rates),
            f"{result['mean_speed_mps']['mean']:.2f}",
        )
    return table


def main(argv: Sequence[str] | None = None) -> int:
    """Evaluate as the command line says."""
    arguments = _arguments(argv)
    compute_on_one_thread()
    if arguments.output is None:
        arguments.output = _FOLDERS[arguments.set]
    console = Console()
    try:
        require_writable(arguments.report)
        if arguments.set == SOUNDNESS:
            _soundness(arguments, console)
        else:
            _paper(arguments, console)
    except PlannerError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        console.print("interrupted; the same command goes on with the cell it was in")
        return INTERRUPTED
    console.print(f"{arguments.output / RESULTS}")
    return 0


def _paper(arguments: argparse.Namespace, console: Console) -> None:
    episodes = PAPER_EPISODES if arguments.episodes is None else arguments.episodes
    if episodes < 1:
        raise ConfigurationError(f"episodes is {episodes}, expected 1 or more")
    names = arguments.policies or ",".join(DEFAULT_POLICIES)
    drivers = contestants(named_policies(names), arguments.training)
    places = _places(arguments)
    cells = cells_of(arguments.scenarios.split(",")) if arguments.scenarios else paper_cells()
    for cell in cells:
        cell.load()  # a wrong name is told before hours of work
    results: list[dict[str, Any]] = []
    campaign = Campaign(places, episodes, Store(arguments.output / "cells"))
    with writing_to(arguments.output):
        head = versions(places.usual, drivers)
        head["entries_in_sight_m"] = entries_in_sight(places, cells[0])
        _run(campaign, drivers, cells, console, results)
        _write(arguments.output, head, results)
        _draw(arguments, console)
    console.print(entries_told(head), end="")
    console.print(_overview(results))


def _soundness(arguments: argparse.Namespace, console: Console) -> None:
    chosen = {
        name: tuple(text.split(",")) if text else ()
        for name, text in (
            ("maps", arguments.map),
            ("scenarios", arguments.scenarios),
            ("policies", arguments.policies),
        )
    }
    episodes = EPISODES if arguments.episodes is None else arguments.episodes
    route, origin = route_and_origin(arguments.route, arguments.origin)
    plan = Plan(
        arguments.output,
        episodes,
        arguments.search_episodes,
        arguments.limit_episodes,
        arguments.sound_episodes,
        route=route,
        origin=origin,
        projector=arguments.projector,
        **chosen,
    )
    # Matplotlib takes a second to load, too long for --help.
    from sim_bridge.evaluation.soundness.reporting.page import write_soundness  # noqa: PLC0415

    with writing_to(arguments.output):
        head, lines = run(plan, console)
        _write(arguments.output, head, lines)
        content = json.loads((arguments.output / RESULTS).read_text(encoding="utf-8"))
        for path in write_soundness(content, arguments.output, arguments.report):
            console.print(f"{path}")
    console.print(entries_told(head), end="")


def _draw(arguments: argparse.Namespace, console: Console) -> None:
    """Draw the figures and write the report from results.json."""
    # Matplotlib takes a second to load, too long for --help.
    from sim_bridge.evaluation.reporting.curves import curves_of  # noqa: PLC0415
    from sim_bridge.evaluation.reporting.figures import draw_figures  # noqa: PLC0415
    from sim_bridge.evaluation.reporting.page import PICTURES, write_report  # noqa: PLC0415

    content = json.loads((arguments.output / RESULTS).read_text(encoding="utf-8"))
    lines = content["cells"]
    found = training_runs(arguments.training)
    named = named_runs(found, shipped_policies().values()) if found else {}
    evaluated = {line["policy"] for line in lines}
    curves = curves_of({name: each for name, each in named.items() if name in evaluated})
    for path in draw_figures(lines, curves, arguments.output):
        console.print(f"{path}")
    if arguments.report:
        pictures = draw_figures(lines, curves, arguments.report.parent / PICTURES)
        write_report(content, curves, pictures, arguments.report)
        console.print(f"{arguments.report}")


if __name__ == "__main__":
    sys.exit(main())
