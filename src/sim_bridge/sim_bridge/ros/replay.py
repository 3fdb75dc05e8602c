# SPDX-License-Identifier: Apache-2.0
"""Feeds a bag's inputs to the real planner nodes and compares their decisions with the bag's.

Exit code: 0 all decisions are as recorded, 1 some differ, 2 the bag or a setting is no good.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import yaml

from risk_dqn_planner.errors import ConfigurationError, PlannerError
from sim_bridge.ros.process import ParameterValue
from sim_bridge.ros.recording import bag_folder
from sim_bridge.ros.replayer import replay


def parse_override(text: str) -> tuple[str, ParameterValue]:
    """Split "name:=value", the value in YAML as ROS writes it.

    Raises:
        ConfigurationError: there is no ":=".
    """
    name, separator, value = text.partition(":=")
    if not separator or not name:
        raise ConfigurationError(f"--set {text} is no override, expected NAME:=VALUE")
    return name, yaml.safe_load(value)


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="replay", description=__doc__)
    parser.add_argument("bag", type=Path, help="its folder, or its name in bags/: four_way")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME:=VALUE",
        help="give the planner's nodes another parameter than was recorded, repeatable",
    )
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    arguments = _arguments(argv)
    bag = bag_folder(arguments.bag)
    try:
        overrides = dict(parse_override(text) for text in arguments.set)
        with tempfile.TemporaryDirectory(prefix="replay_") as folder:
            result = replay(bag, overrides, Path(folder))
    except PlannerError as error:
        print(f"replay: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    if result.compared == 0:
        print(
            f"replay: {bag} holds no decisions to compare with; "
            "update_bags adds those that are taken now",
            file=sys.stderr,
        )
        return 2
    for found in result.differences:
        print(found)
    same = result.compared - len(result.differences)
    print(f"{bag}: {same} of {result.compared} decisions as recorded")
    return 1 if result.differences else 0


if __name__ == "__main__":
    sys.exit(main())
