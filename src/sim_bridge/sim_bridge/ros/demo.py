# SPDX-License-Identifier: Apache-2.0
"""Drives seeded episodes with three real node processes over DDS, and shows what came of them.

Writes a bag, summary.json and a picture of each episode into the output folder. Exit code: 0 all
episodes ended, 1 a node died or an episode never ended, 2 the map, route or another option is no
good.
"""

import argparse
import shutil
import sys
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

from rich.console import Console

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.policies.loading import load_policy
from sim_bridge.folders import writing_to
from sim_bridge.options import number, whole_number
from sim_bridge.ros.drive import drive
from sim_bridge.ros.observer import EpisodeStuckError
from sim_bridge.ros.pictures import EpisodePictures
from sim_bridge.ros.process import NodeDiedError
from sim_bridge.ros.recording import BagWriter, Stored
from sim_bridge.ros.run_settings import RunSettings, add_run_arguments, run_settings
from sim_bridge.ros.session import SilentPlannerError
from sim_bridge.ros.summary import (
    EpisodeResult,
    RunSummary,
    episode_result,
    progress_line,
    results_table,
    run_summary,
)
from sim_bridge.ros.topics import ALL

_DEFAULT_OUT = Path("out/demo")
_BROKEN_RUN = (NodeDiedError, EpisodeStuckError, SilentPlannerError)


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="demo", description=__doc__)
    add_run_arguments(parser)
    parser.add_argument(
        "--episodes", type=whole_number(1), default=6, help="how many [%(default)s]"
    )
    parser.add_argument(
        "--seed", type=whole_number(0), default=0, help="of the first episode [%(default)s]"
    )
    parser.add_argument(
        "--rate",
        type=number(0.0, 1000.0),
        default=0.0,
        help="highest ratio of simulated to real time, 0 for as fast as possible [%(default)s]",
    )
    parser.add_argument(
        "--out", type=Path, default=_DEFAULT_OUT, help="output folder [%(default)s]"
    )
    return parser.parse_args(argv)


def _clear(folder: Path) -> None:
    """Make the folder and remove what an earlier run left there, but nothing else.

    Raises:
        ConfigurationError: nothing can be written there.
    """
    with writing_to(folder):
        for old in (*folder.glob("episode_*.png"), folder / "summary.json"):
            old.unlink(missing_ok=True)
        if (folder / "bag").exists():
            shutil.rmtree(folder / "bag")


def run_demo(
    settings: RunSettings, seeds: Sequence[int], rate: float, folder: Path, console: Console
) -> RunSummary:
    """Drive the episodes, write everything, and return the summary.

    Raises:
        PlannerError: a setting is no good, a node died or an episode never ended.
    """
    load_policy(settings.policy)  # a planner without policy stops for ever: say so at once
    pictures = EpisodePictures(settings)
    _clear(folder)
    results: list[EpisodeResult] = []
    messages: Sequence[Stored] = ()
    with (
        BagWriter(folder / "bag", ALL, settings.notes()) as bag,
        closing(drive(settings, seeds, rate, folder / "log")) as episodes,
        console.status("starting the nodes") as status,
    ):
        for episode in episodes:
            messages = episode.messages
            bag.write(messages)
            result = episode_result(episode.end)
            results.append(result)
            status.update(f"episode {len(results) + 1} of {len(seeds)}")
            pictures.draw(episode, folder / f"episode_{result.seed}.png")
            console.print(progress_line(result, len(results), len(seeds)))
    summary = run_summary(settings, messages, results)
    summary.write(folder / "summary.json")
    return summary


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    arguments = _arguments(argv)
    console = Console()
    seeds = range(arguments.seed, arguments.seed + arguments.episodes)
    try:
        settings = run_settings(arguments)
        summary = run_demo(settings, seeds, arguments.rate, arguments.out, console)
    except PlannerError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1 if isinstance(error, _BROKEN_RUN) else 2
    except KeyboardInterrupt:
        print("demo: interrupted, all nodes have ended", file=sys.stderr)
        return 130
    title = f"{summary.policy} on {summary.map}, scenario {summary.scenario}"
    console.print(results_table(summary.episodes, title))
    console.print(f"bag, pictures and summary.json are in {arguments.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
