# SPDX-License-Identifier: Apache-2.0
"""Tells the story of a bag: every change of decision, with its time and its reason.

For any bag with decisions on any topic, from the simulator or from the vehicle.
Exit code: 0 told, 2 the bag or an option is no good.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from risk_dqn_planner.errors import PlannerError
from sim_bridge.ros.recording import bag_folder
from sim_bridge.ros.story.chapters import chapters
from sim_bridge.ros.story.picture import save_picture
from sim_bridge.ros.story.reading import read
from sim_bridge.ros.story.table import tables

# Into a file or a pipe every change goes on one line, however long.
_PIPE_WIDTH = 400


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="story", description=__doc__)
    parser.add_argument("bag", type=Path, help="its folder, or its name in bags/: four_way")
    parser.add_argument("--topic", help="of the decisions, where the bag has several")
    parser.add_argument("--all", action="store_true", help="every decision, not only changes")
    parser.add_argument(
        "--picture",
        type=Path,
        metavar="FILE",
        help="also draw distance and speed over time: .png, .svg or .pdf",
    )
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    arguments = _arguments(argv)
    bag = bag_folder(arguments.bag)
    try:
        recorded = read(bag, arguments.topic)
        story = chapters(recorded.events, everything=arguments.all)
        if arguments.picture is not None:
            save_picture(story, f"{bag} {recorded.topic}", arguments.picture)
    except PlannerError as error:
        print(f"story: {error}", file=sys.stderr)
        return 2
    console = Console(width=None if sys.stdout.isatty() else _PIPE_WIDTH, highlight=False)
    for part in tables(story):
        console.print(part)
    decisions = sum(len(chapter.moments) for chapter in story)
    changes = sum(len(chapter.changes) for chapter in story)
    console.print(f"{bag} {recorded.topic}: {decisions} decisions, {changes} told")
    return 0


if __name__ == "__main__":
    sys.exit(main())
