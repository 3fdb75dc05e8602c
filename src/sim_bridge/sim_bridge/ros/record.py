# SPDX-License-Identifier: Apache-2.0
"""Records small bags: one episode's inputs each, and the decisions taken on them.

One bag of each own map with Algorithm 1, which stays as it is, and one with the planner's default
policy, to be recorded again whenever another one is shipped.
"""

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY
from sim_bridge.maps import map_names
from sim_bridge.ros.drive import drive
from sim_bridge.ros.planner_link import DECISION_PERIOD_NS
from sim_bridge.ros.recording import BagWriter, Stored
from sim_bridge.ros.run_settings import RunSettings, own_map_settings
from sim_bridge.ros.summary import episode_result
from sim_bridge.ros.topics import DECISION, INPUTS

_TOPICS = (*INPUTS, DECISION)
_KEPT_AFTER_DECISION_NS = (0, 300_000_000)
_TRAINED_MAP = "four_way"
_TRAINED_SEED = 3  # an episode in which all three actions are taken


class Recording(NamedTuple):
    """What is driven in a bag: one episode, by its seed."""

    settings: RunSettings
    seed: int


def bags() -> dict[str, Recording]:
    """Return what is driven in each bag, by the bag's name."""
    trained = f"{_TRAINED_MAP}_{DEFAULT_POLICY}"
    return {
        **{
            name: Recording(own_map_settings(name, "rule_based", "demo_light", supervisor="off"), 0)
            for name in map_names()
        },
        trained: Recording(own_map_settings(_TRAINED_MAP), _TRAINED_SEED),
    }


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


def record(settings: RunSettings, seed: int, target: Path) -> str:
    """Drive one episode and put its bag in place of `target`; return how it went.

    Raises:
        PlannerError: a setting is no good, a node died or the episode never ended.
    """
    with tempfile.TemporaryDirectory(prefix="record_") as folder:
        new = Path(folder) / target.name
        with closing(drive(settings, [seed], 0.0, Path(folder) / "log")) as episodes:
            episode = next(episodes)
            with BagWriter(new, _TOPICS, {**settings.notes(), "seed": str(seed)}) as bag:
                bag.write(thinned(episode.messages))
        shutil.rmtree(target, ignore_errors=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(new, target)
    result = episode_result(episode.end)
    return f"{result.result} after {result.duration_s:.1f} s"


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="record", description=__doc__)
    parser.add_argument("--bag", choices=list(bags()), help="only this one [all]")
    parser.add_argument("--seed", type=int, help="of the episode [the bag's own]")
    parser.add_argument(
        "--folder", type=Path, default=Path("bags"), help="where the bags go [%(default)s]"
    )
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    arguments = _arguments(argv)
    try:
        for name, (settings, own_seed) in bags().items():
            if arguments.bag not in (None, name):
                continue
            seed = own_seed if arguments.seed is None else arguments.seed
            went = record(settings, seed, arguments.folder / name)
            size_kb = sum(f.stat().st_size for f in (arguments.folder / name).iterdir()) / 1000.0
            print(f"{arguments.folder / name}: {went}, {size_kb:.0f} kB")
    except PlannerError as error:
        print(f"record: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
