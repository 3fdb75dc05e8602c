# SPDX-License-Identifier: Apache-2.0
"""Decisions out of any bag, whoever recorded it and with whatever version of the messages.

Messages are read by the definitions that lie in the bag itself, so older bags stay readable;
fields that they lack are unknown.
"""

import bisect
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader, ReaderError
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from risk_dqn_planner.errors import BagError
from risk_dqn_planner.policies.base import Action, Reason
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.recording import installed_types, no_bag

DECISION = "intersection_msgs/msg/Decision"
EPISODE = "intersection_msgs/msg/EpisodeEvent"
ODOMETRY = "nav_msgs/msg/Odometry"
_EVENTS = ("starts", "ends: success", "ends: collision", "ends: timeout")
# An older speed of the ego says nothing about now.
_SAME_TIME_NS = SECOND_NS // 2


@dataclass(frozen=True)
class Moment:
    """A decision at its time; NaN where the bag does not tell a number.

    cause: what makes two decisions the same for a reader, besides the action.
    """

    stamp_ns: int
    action: Action
    text: str
    cause: tuple[int, ...]
    stop_line_distance_m: float = math.nan
    ego_speed_mps: float = math.nan


@dataclass(frozen=True)
class Mark:
    """The start or the end of an episode, in words."""

    stamp_ns: int
    is_start: bool
    text: str


@dataclass(frozen=True)
class Recorded:
    """What a bag holds for a story, in the order in which it was recorded."""

    topic: str
    events: Sequence[Moment | Mark]


def read(path: Path, topic: str | None = None) -> Recorded:
    """Read the decisions of one topic, and the episodes' starts and ends.

    Raises:
        BagError: the bag is missing or unreadable, holds no decision, or holds those of several
            topics of which none was chosen.
    """
    folder = path.parent if path.is_file() else path
    try:
        with Reader(folder) as reader:
            chosen = _choose(folder, reader.connections, topic)
            return Recorded(chosen, _events(reader, chosen))
    except FileNotFoundError as error:
        raise no_bag(folder) from error
    except (ReaderError, SerdeError, TypesysError, OSError) as error:
        raise BagError(f"{folder} cannot be read as a bag: {error}") from error


def _choose(folder: Path, connections: Sequence[Connection], topic: str | None) -> str:
    counts = {c.topic: 0 for c in connections if c.msgtype == DECISION}
    for connection in connections:
        if connection.topic in counts:
            counts[connection.topic] += connection.msgcount
    found = [name for name, count in counts.items() if count > 0]
    if topic is not None:
        if topic in found:
            return topic
        known = f"expected one of: {', '.join(found)}" if found else "nor on any other topic"
        raise BagError(f"{folder} holds no {DECISION} on {topic}, {known}")
    if not found:
        raise BagError(f"{folder} holds no message of type {DECISION}, nothing to tell")
    if len(found) > 1:
        raise BagError(f"{folder} holds decisions on {', '.join(found)}: choose one by --topic")
    return found[0]


def _events(reader: Reader, topic: str) -> list[Moment | Mark]:
    speeds = [c for c in reader.connections if c.msgtype == ODOMETRY]
    if len({c.topic for c in speeds}) > 1:
        speeds = []  # nobody knows whose they are
    wanted = [
        c
        for c in reader.connections
        if (c.msgtype == DECISION and c.topic == topic) or c.msgtype == EPISODE
    ]
    events: list[Moment | Mark] = []
    odometry: list[tuple[int, float]] = []
    for connection, stamp_ns, message in _messages(reader, [*wanted, *speeds]):
        if connection.msgtype == ODOMETRY:
            odometry.append((stamp_ns, float(message.twist.twist.linear.x)))
        elif connection.msgtype == EPISODE:
            events.append(_mark(stamp_ns, message))
        else:
            events.append(_moment(stamp_ns, message))
    odometry.sort()
    told = [_with_speed(e, odometry) if isinstance(e, Moment) else e for e in events]
    return [e for _, same in groupby(told, lambda e: e.stamp_ns) for e in sorted(same, key=_rank)]


def _rank(event: Moment | Mark) -> int:
    """Order what bears the same time: an episode starts before its decisions and ends after."""
    if isinstance(event, Moment):
        return 1
    return 0 if event.is_start else 2


def _messages(
    reader: Reader, connections: Sequence[Connection]
) -> Iterator[tuple[Connection, int, Any]]:
    """Yield messages with the time in their header, that of recording where it has none."""
    stores = {c.id: _types(c) for c in connections}
    for connection, recorded_ns, data in reader.messages(connections):
        message: Any = stores[connection.id].deserialize_cdr(data, connection.msgtype)
        stamp = message.header.stamp
        yield connection, int(stamp.sec) * SECOND_NS + int(stamp.nanosec) or recorded_ns, message


def _types(connection: Connection) -> Typestore:
    """Return the types by which one connection was recorded; those installed if none are told."""
    if not connection.msgdef.data:
        return installed_types()
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
    return store


def _mark(stamp_ns: int, message: Any) -> Mark:  # noqa: ANN401 (of a type that the bag defines)
    event = int(message.event)
    words = _EVENTS[event] if event < len(_EVENTS) else f"event {event}"
    if event > 0:
        words += f" after {message.duration_s:.1f} s"
    return Mark(stamp_ns, event == 0, f"episode {message.scenario}, seed {message.seed}, {words}")


def _moment(stamp_ns: int, message: Any) -> Moment:  # noqa: ANN401 (of a type that the bag defines)
    try:
        action = Action(message.action)
    except ValueError as error:
        raise BagError(f"a decision at {stamp_ns} ns has the action {message.action}") from error
    names = ("reason", "faulty_input", "supervisor")
    cause = [int(getattr(message, name, 0)) for name in names]
    # Of those that nothing hinders, or that a network rates, the nearest vehicle changes often.
    if message.reason in {Reason.VEHICLE, Reason.HIDDEN_VEHICLE}:
        cause += [int(message.critical_vehicle_id), int(message.critical_lane_id)]
    why = getattr(message, "explanation", None)
    return Moment(
        stamp_ns,
        action,
        str(message.text),
        tuple(cause),
        float(getattr(why, "stop_line_distance_m", math.nan)),
        float(getattr(why, "ego_speed_mps", math.nan)),
    )


def _with_speed(moment: Moment, odometry: Sequence[tuple[int, float]]) -> Moment:
    """Add the ego's speed from odometry where the decision itself does not tell it."""
    if not math.isnan(moment.ego_speed_mps):
        return moment
    place = bisect.bisect_right(odometry, (moment.stamp_ns, math.inf)) - 1
    if place < 0 or moment.stamp_ns - odometry[place][0] > _SAME_TIME_NS:
        return moment
    return replace(moment, ego_speed_mps=odometry[place][1])
