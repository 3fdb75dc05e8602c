# SPDX-License-Identifier: Apache-2.0
"""Replays bags, prints which decisions change, and with a reason makes the new ones expected.

The inputs of the bags stay as they are: this is for intended changes of what is decided on them.
The reason goes into CHANGES.md beside the bags.
"""

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from intersection_msgs.msg import Decision
from rclpy.serialization import deserialize_message, serialize_message

from risk_dqn_planner.errors import BagError, PlannerError
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.expectations import changes, lines_of, log_changes, write_decisions
from sim_bridge.ros.recording import ALL_BAGS, BagWriter, Stored, bag_folder
from sim_bridge.ros.replayer import Replayed, replay
from sim_bridge.ros.topics import DECISION, INPUTS

_TOPICS = (*INPUTS, DECISION)


def changed_lines(found: Replayed) -> list[str]:
    """Return a line for each decision that is another one than recorded."""
    before = lines_of(deserialize_message(m.data, Decision) for m in found.bag.of(DECISION))
    return changes(before, lines_of(decision for _, decision in _taken(found)))


def _taken(found: Replayed) -> list[tuple[int, Decision]]:
    taken = [(stamp_ns, d) for stamp_ns, d in found.decisions.items() if d is not None]
    if len(taken) < len(found.decisions):
        missing = next(stamp_ns for stamp_ns, d in found.decisions.items() if d is None)
        raise BagError(f"{found.bag.path}: no decision came in time at {missing / SECOND_NS:.1f} s")
    return taken


def update(found: Replayed) -> None:
    """Write the decisions that were taken now into the bag, in place of those recorded."""
    path = found.bag.path
    inputs = [message for message in found.bag.messages if message.topic != DECISION.name]
    decisions = [
        Stored(stamp_ns, DECISION.name, serialize_message(decision))
        for stamp_ns, decision in _taken(found)
    ]
    with tempfile.TemporaryDirectory(prefix="update_") as folder:
        new = Path(folder) / path.name
        with BagWriter(new, _TOPICS, found.bag.notes) as bag:
            bag.write([*inputs, *decisions])
        write_decisions(new, lines_of(decision for _, decision in _taken(found)))
        shutil.rmtree(path)
        shutil.move(new, path)


def _replayed(path: Path) -> Replayed:
    with tempfile.TemporaryDirectory(prefix="replay_") as folder:
        return replay(path.resolve(), {}, Path(folder))


def update_all(paths: Sequence[Path], reason: str | None) -> bool:
    """Replay bags and update those that change; tell whether all decisions are now expected.

    Raises:
        PlannerError: a bag cannot be replayed.
    """
    changed: dict[str, list[str]] = {}
    for path in paths:
        found = _replayed(path)
        lines = changed_lines(found)
        print(f"{path.name}: {len(lines)} decisions change", flush=True)
        for line in lines:
            print(f"  {line}")
        if lines:
            changed[path.name] = lines
        if lines and reason:
            update(found)
    if changed and reason:
        log_changes(paths[0].resolve().parent, changed, reason)
    return not changed or bool(reason)


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="update_bags", description=__doc__)
    parser.add_argument("bags", type=Path, nargs="*", help="their folders or names [all]")
    parser.add_argument(
        "--folder", type=Path, default=ALL_BAGS, help="where all bags are [%(default)s]"
    )
    parser.add_argument("--reason", help="why the decisions may change; without it none does")
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    given = _arguments(argv)
    everything = sorted(path.parent for path in given.folder.glob("*/metadata.yaml"))
    try:
        if not (given.bags or everything):
            raise BagError(f"{given.folder} holds no bags")
        chosen = [bag_folder(path, given.folder) for path in given.bags]
        accepted = update_all(chosen or everything, given.reason)
    except PlannerError as error:
        print(f"update_bags: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    if not accepted:
        print(
            "update_bags: nothing was updated; if these decisions may change, say why: "
            "make bags UPDATE=1 REASON='...'",
            file=sys.stderr,
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
