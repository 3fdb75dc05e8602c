# SPDX-License-Identifier: Apache-2.0
"""Drives for an hour of simulated time with three real node processes and watches them.

Passes if each process' memory, threads and open files stay flat after a warm-up, no decision is
missing for more than 1 s of simulated time within an episode or was Stop for a fault, and no node
died. Writes soak.json and memory.png, also when it is interrupted. Exit code: 0 it passes, 1 it
does not, 2 an option is no good, 130 interrupted.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.policies.loading import load_policy
from sim_bridge.folders import writing_to
from sim_bridge.learning.checkpoint import git_revision
from sim_bridge.options import number, whole_number
from sim_bridge.ros.node_group import NodeGroup
from sim_bridge.ros.process import NodeCommand, NodeDiedError
from sim_bridge.ros.run_settings import RunSettings, add_run_arguments, run_settings
from sim_bridge.ros.session import SilentPlannerError, ros_session, wait_until
from sim_bridge.ros.soak.pictures import draw_memory
from sim_bridge.ros.soak.processes import usage
from sim_bridge.ros.soak.trend import Limits
from sim_bridge.ros.soak.verdict import Sample, Soak, write_json
from sim_bridge.ros.soak.watch import Watch

_DEFAULT_OUT = Path("out/soak")
_START_S = 240.0
_SILENCE_S = 30.0
_SAMPLE_S = 0.5
_INTERRUPTED = 130

Report = Callable[[Sample, float], None]


@dataclass
class Recording:
    """What a drive has left so far; it is complete at any time."""

    samples: list[Sample]
    watch: Watch | None = None
    began_s: float = 0.0
    ended_s: float = 0.0
    died: str = ""

    def soak(self) -> Soak | None:
        """Return what was seen, None if nothing was."""
        if self.watch is None or not self.samples:
            return None
        ledger, errors = self.watch.result()
        return Soak(self.samples, ledger, errors, self.ended_s - self.began_s, self.died)


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="soak", description=__doc__)
    add_run_arguments(parser)
    parser.add_argument(
        "--hours",
        type=number(0.001, 1000.0),
        default=1.0,
        help="of simulated driving [%(default)s]",
    )
    parser.add_argument(
        "--seed", type=whole_number(0), default=0, help="of the first episode [%(default)s]"
    )
    parser.add_argument(
        "--out", type=Path, default=_DEFAULT_OUT, help="output folder [%(default)s]"
    )
    return parser.parse_args(argv)


def _commands(settings: RunSettings, seed: int) -> list[NodeCommand]:
    """Return the three nodes, the simulator playing one episode after the other by itself."""
    simulator = settings.simulator_command(0.0)
    parameters = {**simulator.parameters, "autostart": True, "seed": seed}
    return [replace(simulator, parameters=parameters), *settings.planner_commands()]


def soak_nodes(
    settings: RunSettings, seed: int, hours: float, logs: Path, record: Recording, tell: Report
) -> None:
    """Drive as fast as possible for so long; whatever is seen goes into the record at once.

    Raises:
        SilentPlannerError: no episode began, or the planner fell silent.
    """
    with ros_session("soak") as node, NodeGroup(_commands(settings, seed), logs) as nodes:
        watch = Watch(node)
        wait_until(lambda: watch.driven_s() > 0.0, "the first episode", _START_S, nodes.check)
        record.watch, record.began_s = watch, time.monotonic()
        while True:
            try:
                nodes.check()
            except NodeDiedError as error:
                record.died = str(error)
                return
            if watch.silent_s() > _SILENCE_S:
                raise SilentPlannerError(f"no decision for {_SILENCE_S:g} s of real time")
            held = {name: usage(pid) for name, pid in nodes.pids().items()}
            record.samples.append(Sample(watch.driven_s(), held))
            record.ended_s = time.monotonic()
            tell(record.samples[-1], record.ended_s - record.began_s)
            if record.samples[-1].driven_s >= 3600.0 * hours:
                return
            time.sleep(_SAMPLE_S)


def _describe(settings: RunSettings, seed: int, hours: float) -> dict[str, Any]:
    return {
        "git_revision": git_revision(),
        "asked_h": hours,
        "first_seed": seed,
        **settings.notes(),
    }


def run_soak(
    settings: RunSettings, seed: int, hours: float, folder: Path, console: Console
) -> tuple[Recording, bool]:
    """Drive, showing how far it is; return what was recorded and whether it was interrupted."""
    record, interrupted = Recording([]), False
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=24),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("starting the nodes", total=3600.0 * hours)

        def tell(sample: Sample, wall_s: float) -> None:
            memory = ", ".join(
                f"{name.removesuffix('_node')} {held.resident_bytes / 1e6:.1f} MB"
                for name, held in sample.usage.items()
            )
            speed = sample.driven_s / max(wall_s, 1.0)
            text = f"{sample.driven_s / 60.0:.1f} min driven at {speed:.1f}x; {memory}"
            progress.update(task, completed=sample.driven_s, description=text)

        try:
            soak_nodes(settings, seed, hours, folder / "log", record, tell)
        except KeyboardInterrupt:
            interrupted = True
    return record, interrupted


def _write(soak: Soak, about: dict[str, Any], title: str, folder: Path) -> list[str]:
    """Write both files; return why it does not pass."""
    limits = Limits()
    document = soak.document(limits, about)
    write_json(folder / "soak.json", document)
    draw_memory(soak, limits, title, folder / "memory.png")
    return list(document["complaints"])


def _make(folder: Path) -> None:
    with writing_to(folder):
        for old in ("soak.json", "memory.png"):
            (folder / old).unlink(missing_ok=True)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    arguments = _arguments(argv)
    console = Console()
    folder: Path = arguments.out
    try:
        settings = run_settings(arguments)
        load_policy(settings.policy)  # a planner without policy stops for ever: say so at once
        _make(folder)
        record, interrupted = run_soak(settings, arguments.seed, arguments.hours, folder, console)
    except PlannerError as error:
        print(f"soak: {error}", file=sys.stderr)
        return 1 if isinstance(error, NodeDiedError | SilentPlannerError) else 2
    soak = record.soak()
    if soak is None:
        print(f"soak: {record.died or 'interrupted before anything was seen'}", file=sys.stderr)
        return _INTERRUPTED if interrupted else 1
    about = {**_describe(settings, arguments.seed, arguments.hours), "interrupted": interrupted}
    title = f"{settings.policy} on {settings.map_name}, {settings.scenario}"
    complaints = _write(soak, about, title, folder)
    return _conclude(soak, complaints, interrupted, folder, console)


def _conclude(
    soak: Soak, complaints: Sequence[str], interrupted: bool, folder: Path, console: Console
) -> int:
    for process in soak.trends(Limits()):
        memory = process.memory
        console.print(
            f"{process.name}: {memory.begin:.1f} MB after the warm-up, {memory.end:.1f} MB at the "
            f"end, slope {memory.slope_per_h:+.2f} MB/h",
            highlight=False,
        )
    ledger = soak.ledger
    console.print(
        f"{soak.driven_s / 3600.0:.2f} h of simulated time in {soak.wall_s / 60.0:.1f} min, "
        f"{sum(ledger.episodes.values())} episodes, {ledger.decisions} decisions, longest gap "
        f"{ledger.longest_gap_s:g} s",
        highlight=False,
    )
    for complaint in complaints:
        print(f"soak: {complaint}", file=sys.stderr)
    console.print(f"soak.json and memory.png are in {folder}")
    if interrupted:
        print("soak: interrupted, all nodes have ended", file=sys.stderr)
        return _INTERRUPTED
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
