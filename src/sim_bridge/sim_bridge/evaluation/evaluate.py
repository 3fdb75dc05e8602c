# SPDX-License-Identifier: Apache-2.0
"""Evaluates policies in every situation of the paper's figures, on the same episodes each.

Writes results.json and the paper's four figures into the output folder. Interrupted, the same
command goes on where it was. Exit code: 0 done, 2 an option is no good, 130 interrupted.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from risk_dqn_planner.errors import ConfigurationError, PlannerError
from risk_dqn_planner.map.loader import MapOrigin
from risk_dqn_planner.map.route import parse_route
from risk_dqn_planner.policies.shipped import shipped_policies
from sim_bridge.environment.place import load_place
from sim_bridge.evaluation.campaign import Campaign, Places, has_optimum, versions
from sim_bridge.evaluation.cells import Cell, cells_of, paper_cells
from sim_bridge.evaluation.contestants import DEFAULT_POLICIES, contestants, named_policies
from sim_bridge.evaluation.rollout import Contestant
from sim_bridge.evaluation.store import Store, write_whole
from sim_bridge.evaluation.training_runs import RUN_FOLDERS, named_runs, training_runs
from sim_bridge.maps import map_names

RESULTS = "results.json"
INTERRUPTED = 130


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="evaluate", description=__doc__)
    add = parser.add_argument
    add("--episodes", type=int, default=2000, help="in each cell [%(default)s]")
    add(
        "--policies",
        default=",".join(DEFAULT_POLICIES),
        help="names, policy files (* allowed) or module:factory, by commas [%(default)s]",
    )
    add("--scenarios", help="names or .yaml files instead of the paper's cells, by commas")
    maps = ", ".join(map_names())
    add("--map", default="four_way", help=f"own map ({maps}) or an .osm file [%(default)s]")
    add("--route", help="lanelet ids, separated by commas; own maps have one")
    add("--origin", help="latitude,longitude of the map's projection [deg]")
    add(
        "--training",
        type=Path,
        nargs="*",
        default=RUN_FOLDERS,
        help=f"folders of training runs [{' '.join(map(str, RUN_FOLDERS))}]",
    )
    add("--output", type=Path, default=Path("out/evaluation"), help="folder [%(default)s]")
    add(
        "--report", type=Path, help="also write this page, its pictures to images/results beside it"
    )
    return parser.parse_args(argv)


def _places(arguments: argparse.Namespace) -> Places:
    route = None if arguments.route is None else parse_route(arguments.route)
    origin = MapOrigin.from_text(arguments.origin) if arguments.origin else None
    return Places(lambda reach_m: load_place(arguments.map, route, origin, sensor_range_m=reach_m))


def _run(
    campaign: Campaign,
    drivers: list[Contestant],
    cells: list[Cell],
    console: Console,
    results: list[dict[str, Any]],
) -> None:
    """Append the results of all drivers in all cells, showing how far it is."""
    columns = (
        TextColumn("{task.description:<52}"),
        BarColumn(bar_width=24),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as progress:
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
    folder.mkdir(parents=True, exist_ok=True)
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
    console = Console()
    results: list[dict[str, Any]] = []
    try:
        if arguments.episodes < 1:
            raise ConfigurationError(f"episodes is {arguments.episodes}, expected 1 or more")
        drivers = contestants(named_policies(arguments.policies), arguments.training)
        places = _places(arguments)
        cells = cells_of(arguments.scenarios.split(",")) if arguments.scenarios else paper_cells()
        for cell in cells:
            cell.load()  # a wrong name is told before hours of work
        campaign = Campaign(places, arguments.episodes, Store(arguments.output / "cells"))
        _run(campaign, drivers, cells, console, results)
        _write(arguments.output, versions(places.usual, drivers), results)
        _draw(arguments, console)
    except PlannerError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        console.print("interrupted; the same command goes on with the cell it was in")
        return INTERRUPTED
    console.print(_overview(results))
    console.print(f"{arguments.output / RESULTS}")
    return 0


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
