# SPDX-License-Identifier: Apache-2.0
"""Makes a bag of another stack into one that `replay` and the planner's nodes take.

Objects of autoware_perception_msgs/msg/TrackedObjects and derived_object_msgs/msg/ObjectArray go
through the situation node's own adapters; no package of that stack is needed. Messages are stored
by the time in their header. The new bag holds no decisions: `update_bags` adds those that the
planner takes.
"""

import argparse
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message

from risk_dqn_planner.errors import BagError, PlannerError
from risk_dqn_planner.ros.adapters.config import LEFT_OUT, AdapterConfig
from risk_dqn_planner.ros.conversions import area_to_message, ego_from_message, route_to_message
from sim_bridge.ros.recording import BagWriter, Stored, read_bag, stamp_of
from sim_bridge.ros.run_settings import RunSettings, add_run_arguments, run_settings
from sim_bridge.ros.topics import DECISION, INPUTS, OBJECTS, ODOMETRY, ROUTE, VISIBLE_AREA

_CORNERS = 64


def convert(
    source: Path,
    target: Path,
    settings: RunSettings,
    names: Mapping[str, str],
    visible_range_m: float | None,
    adapters: AdapterConfig,
) -> dict[str, int]:
    """Write the bag; return how many messages each topic has.

    names: topics of the source by what they are called here. Without a route that of the settings
    is taken, without a visible area all within `visible_range_m` of the ego counts as seen.

    Raises:
        BagError: the source cannot be used, the target exists, nothing says what was seen, or a
            topic is named twice.
    """
    if VISIBLE_AREA.name not in names and visible_range_m is None:
        raise BagError(
            f"{source}: nothing says what the sensors saw, expected a topic with the visible area, "
            "or how far the ego sees in all directions"
        )
    for name in names.values():
        inputs = [own.strip("/") for own, given in names.items() if given == name]
        if len(inputs) > 1:
            raise BagError(
                f"{source}: {name} in two places, as {' and as '.join(inputs)}, "
                "expected a topic of its own for each"
            )
    topics = [topic for topic in INPUTS if topic.name in names]
    bag = read_bag(source, topics, adapters, names)
    messages = [
        Stored(stamp_of(message.data), message.topic, message.data) for message in bag.messages
    ]
    if not any(message.topic == OBJECTS.name for message in messages):
        raise BagError(f"{source} holds no objects, expected some in {names[OBJECTS.name]}")
    if VISIBLE_AREA.name not in names and visible_range_m is not None:
        messages += _discs(messages, visible_range_m)
    if ROUTE.name not in names:
        messages.append(_route(settings, min(message.stamp_ns for message in messages)))
    with BagWriter(target, (*INPUTS, DECISION), settings.notes()) as writer:
        writer.write(messages)
    return {topic.name: sum(m.topic == topic.name for m in messages) for topic in INPUTS}


def _discs(messages: Iterable[Stored], range_m: float) -> list[Stored]:
    """Return a disc about the ego for each of its poses."""
    turn = np.linspace(0.0, math.tau, _CORNERS, endpoint=False)
    disc = range_m * np.column_stack((np.cos(turn), np.sin(turn)))
    found = []
    for message in messages:
        if message.topic == ODOMETRY.name:
            odometry = deserialize_message(message.data, Odometry)
            ego = ego_from_message(odometry)
            area = area_to_message(
                np.add(disc, (ego.x_m, ego.y_m)), message.stamp_ns, odometry.header.frame_id
            )
            found.append(Stored(message.stamp_ns, VISIBLE_AREA.name, serialize_message(area)))
    return found


def _route(settings: RunSettings, stamp_ns: int) -> Stored:
    message = route_to_message(settings.route, stamp_ns)
    return Stored(stamp_ns, ROUTE.name, serialize_message(message))


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="convert", description=__doc__)
    parser.add_argument("bag", type=Path, help="folder of the bag")
    parser.add_argument("target", type=Path, help="folder of the new bag")
    for topic in INPUTS:
        option = topic.name.strip("/").replace("_", "-")
        optional = topic in (ROUTE, VISIBLE_AREA)
        parser.add_argument(
            f"--{option}-topic",
            metavar="TOPIC",
            default=None if optional else topic.name,
            help=f"{topic.type_name} or as good [{'none' if optional else topic.name}]",
        )
    parser.add_argument(
        "--visible-range", type=float, metavar="M", help="all within is seen, if no topic says [m]"
    )
    default = AdapterConfig()
    parser.add_argument("--left-out", choices=LEFT_OUT, default=default.left_out)
    parser.add_argument("--min-certainty", type=float, default=default.min_certainty)
    parser.add_argument("--unknown-speed", type=float, default=default.unknown_speed_mps)
    add_run_arguments(parser)
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    given = _arguments(argv)
    options = vars(given)
    names = {topic.name: options[f"{topic.name.strip('/')}_topic"] for topic in INPUTS}
    try:
        counts = convert(
            given.bag,
            given.target,
            run_settings(given),
            {own: name for own, name in names.items() if name is not None},
            given.visible_range,
            AdapterConfig(given.left_out, given.min_certainty, given.unknown_speed),
        )
    except PlannerError as error:
        print(f"convert: {error}", file=sys.stderr)
        return 2
    print(f"{given.target}: " + ", ".join(f"{count} of {name}" for name, count in counts.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
