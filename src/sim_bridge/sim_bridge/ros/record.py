# SPDX-License-Identifier: Apache-2.0
"""Records the bags anew: one episode's inputs each, and the decisions taken on them.

Where decisions differ from those expected so far, the differences are printed, and nothing is
replaced unless a reason is given, which goes into CHANGES.md beside the bags.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

from intersection_msgs.msg import Decision
from rclpy.serialization import deserialize_message

from risk_dqn_planner.errors import BagError, PlannerError
from sim_bridge.ros.bag_plan import PlannedBag, bags
from sim_bridge.ros.drive import drive
from sim_bridge.ros.expectations import (
    changes,
    lines_of,
    log_changes,
    read_decisions,
    write_decisions,
)
from sim_bridge.ros.planner_link import DECISION_PERIOD_NS
from sim_bridge.ros.recording import ALL_BAGS, BagWriter, Stored
from sim_bridge.ros.summary import episode_result
from sim_bridge.ros.topics import DECISION, INPUTS

_TOPICS = (*INPUTS, DECISION)
_ATTEMPTS = 2  # on a busy computer decisions may come late
_KEPT_AFTER_DECISION_NS = (0, 300_000_000)


def thinned(messages: Sequence[Stored]) -> list[Stored]:
    """Keep the decisions and two of five inputs, among them those that decisions were taken on.

    The others keep a planner that listens in real time from calling its inputs stale.
    """
    names = {topic.name for topic in _TOPICS}
    return [
        m
        for m in messages
        if m.topic in names and m.stamp_ns % DECISION_PERIOD_NS in _KEPT_AFTER_DECISION_NS
    ]


def record(planned: PlannedBag, target: Path) -> str:
    """Drive one episode and write its bag; return how it went.

    Raises:
        PlannerError: a setting is no good, a node died, the episode never ended, or decisions
        came late on a busy computer.
    """
    with (
        tempfile.TemporaryDirectory(prefix="record_") as log,
        closing(drive(planned.settings, [planned.seed], 0.0, Path(log))) as episodes,
    ):
        episode = next(episodes)
        if episode.end.late_decisions:
            # The ego braked for want of a decision, which another computer would not repeat.
            raise BagError(f"{episode.end.late_decisions} decisions came late, record it again")
        kept = thinned(episode.messages)
        with BagWriter(target, _TOPICS, planned.notes()) as bag:
            bag.write(kept)
    decisions = sorted(
        (m for m in kept if m.topic == DECISION.name), key=lambda message: message.stamp_ns
    )
    write_decisions(target, lines_of(deserialize_message(m.data, Decision) for m in decisions))
    result = episode_result(episode.end)
    return f"{result.result} after {result.duration_s:.1f} s"


def _record_in_a_process(name: str, seed: int | None, folder: Path) -> str:
    """Record one bag in a process of its own, with a ROS domain of its own; return its report."""
    command = [sys.executable, "-m", __spec__.name, "--child", str(folder), "--bag", name]
    if seed is not None:
        command += ["--seed", str(seed)]
    for _ in range(_ATTEMPTS):
        done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603 (this very program)
        if done.returncode == 0:
            return done.stdout.strip()
        shutil.rmtree(folder / name, ignore_errors=True)
    raise BagError(f"{name} was not recorded: {done.stderr.strip() or done.returncode}")


def _accepted(new: Path, old: Path, reason: str | None) -> bool:
    """Print what differs from the expected decisions, and log it if there is a reason."""
    found: Mapping[str, list[str]] = {
        bag.name: changes(read_decisions(old / bag.name), read_decisions(bag))
        for bag in sorted(new.iterdir())
        if read_decisions(old / bag.name)
    }
    changed = {name: lines for name, lines in found.items() if lines}
    for name, lines in changed.items():
        print(f"{name}: {len(lines)} decisions changed")
        for line in lines:
            print(f"  {line}")
    if changed and reason:
        log_changes(old, changed, reason)
    return not changed or bool(reason)


def record_all(
    names: Sequence[str], seed: int | None, folder: Path, reason: str | None, jobs: int
) -> bool:
    """Record bags and put them into the folder; tell whether their decisions were accepted.

    Raises:
        BagError: one could not be recorded, none is replaced then.
    """
    with tempfile.TemporaryDirectory(prefix="bags_") as place, ThreadPoolExecutor(jobs) as pool:
        new = Path(place)
        reports = pool.map(lambda name: _record_in_a_process(name, seed, new), names)
        for report in reports:
            print(report, flush=True)
        if not _accepted(new, folder, reason):
            return False
        folder.mkdir(parents=True, exist_ok=True)
        for bag in sorted(new.iterdir()):
            shutil.rmtree(folder / bag.name, ignore_errors=True)
            shutil.move(bag, folder / bag.name)
    return True


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="record", description=__doc__)
    parser.add_argument(
        "--bag", type=lambda text: Path(text).name, choices=list(bags()), help="only this one [all]"
    )
    parser.add_argument("--seed", type=int, help="of the episode [the bag's own]")
    parser.add_argument(
        "--folder", type=Path, default=ALL_BAGS, help="where the bags go [%(default)s]"
    )
    parser.add_argument("--reason", help="why decisions may differ from those expected so far")
    parser.add_argument("--jobs", type=int, default=2, help="bags at a time [%(default)s]")
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    return parser.parse_args(argv)


def _record_child(name: str, seed: int | None, folder: Path) -> None:
    planned = bags()[name]
    if seed is not None:
        planned = planned._replace(seed=seed)
    went = record(planned, folder / name)
    size_kb = sum(file.stat().st_size for file in (folder / name).iterdir()) / 1000.0
    print(f"{name}: {went}, {size_kb:.0f} kB")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    given = _arguments(argv)
    names = list(bags()) if given.bag is None else [given.bag]
    try:
        if given.child is not None:
            _record_child(given.bag, given.seed, given.child)
        elif not record_all(names, given.seed, given.folder, given.reason, given.jobs):
            print(
                "record: decisions changed, nothing was replaced; if they may, say why: "
                "make bags REASON='...'",
                file=sys.stderr,
            )
            return 1
    except PlannerError as error:
        print(f"record: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
