# SPDX-License-Identifier: Apache-2.0
"""How streams of messages are disturbed: each function says what is sent instead of one frame."""

import copy
import math
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from geometry_msgs.msg import Point32
from intersection_msgs.msg import PerceivedObject

from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.ros.conversions import to_stamp
from risk_dqn_planner.ros.streams import SECOND_NS

Message: TypeAlias = Any  # of whichever type


class Frame(NamedTuple):
    """What a disturbance is given: its healthy message, to be kept or changed, and those before.

    number: of disturbed frames before. past: healthy messages, the newest last. before: the last
    one ahead of the fault.
    """

    number: int
    message: Message
    past: Sequence[Message]
    before: Message
    now_ns: int
    model: IntersectionModel


def lost(_: Frame) -> list[Message]:
    return []


def late(frame: Frame, by_frames: int = 10) -> list[Message]:
    """Messages come by_frames later than they should."""
    return [] if frame.number < by_frames else [frame.past[-1 - by_frames]]


def frozen(frame: Frame) -> list[Message]:
    """The last message before the fault comes again and again."""
    return [frame.before]


def swapped(frame: Frame) -> list[Message]:
    """Every other frame brings an older message than the one before it did."""
    return [frame.message] if frame.number % 2 == 0 else [frame.past[-3]]


def replayed(frame: Frame) -> list[Message]:
    """Every other frame brings what came 0.4 s ago, as of a recording that is played again."""
    return [frame.message] if frame.number % 2 == 1 else [frame.past[-5]]


def at_times_the_rate(frame: Frame, times: int) -> list[Message]:
    """So many messages instead of one, with stamps in between."""
    return [
        stamped(frame.message, frame.now_ns - k * SECOND_NS // 10 // times)
        for k in reversed(range(times))
    ]


def rarely(frame: Frame, every: int) -> list[Message]:
    return [frame.message] if frame.number % every == 0 else []


def moved_in_time(frame: Frame, by_s: float) -> list[Message]:
    return [stamped(frame.message, max(frame.now_ns + round(by_s * SECOND_NS), 0))]


def unset_stamp(frame: Frame) -> list[Message]:
    return [stamped(frame.message, 0)]


def stamped(message: Message, stamp_ns: int) -> Message:
    changed = copy.deepcopy(message)
    changed.header.stamp = to_stamp(stamp_ns)
    return changed


def in_frame(frame: Frame, name: str) -> list[Message]:
    frame.message.header.frame_id = name
    return [frame.message]


def with_field(frame: Frame, path: str, value: object) -> list[Message]:
    """A field of the message, such as "objects.0.x_m", has another value."""
    *parents, last = path.split(".")
    owner = frame.message
    for name in parents:
        owner = owner[int(name)] if name.isdigit() else getattr(owner, name)
    setattr(owner, last, value)
    return [frame.message]


def with_corners(frame: Frame, corners: Sequence[tuple[float, float]]) -> list[Message]:
    frame.message.polygon.points = [Point32(x=float(x), y=float(y)) for x, y in corners]
    return [frame.message]


def bow_tie(frame: Frame) -> list[Message]:
    """The second quarter of the outline comes before the first: it crosses itself."""
    points = frame.message.polygon.points
    quarter = len(points) // 4
    mixed = [*points[quarter : 2 * quarter], *points[:quarter], *points[2 * quarter :]]
    frame.message.polygon.points = mixed
    return [frame.message]


def many_corners(frame: Frame, count: int) -> list[Message]:
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    center = frame.message.polygon.points[0]
    rim = zip(center.x + 100.0 * np.cos(turn), center.y + 100.0 * np.sin(turn), strict=True)
    return with_corners(frame, list(rim))


def crowd(frame: Frame, count: int) -> list[Message]:
    """Others in a grid of 1.5 m about the crossing, each standing where it was."""
    side = math.ceil(math.sqrt(count))
    frame.message.objects = [
        PerceivedObject(
            id=1000 + k, x_m=1.5 * (k % side), y_m=1.5 * (k // side), length_m=4.0, width_m=2.0
        )
        for k in range(count)
    ]
    return [frame.message]


def nobody(frame: Frame) -> list[Message]:
    frame.message.objects = []
    return [frame.message]


def twins(frame: Frame) -> list[Message]:
    frame.message.objects[1].id = frame.message.objects[0].id
    return [frame.message]


def jumping(frame: Frame, by_m: float) -> list[Message]:
    """An object is somewhere else in every other frame."""
    frame.message.objects[0].x_m += by_m * (frame.number % 2)
    return [frame.message]


def aside(frame: Frame, by_m: float) -> list[Message]:
    """The ego left of where it is."""
    pose = frame.message.pose.pose
    heading = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
    pose.position.x -= by_m * math.sin(heading)
    pose.position.y += by_m * math.cos(heading)
    return [frame.message]


def turned(frame: Frame) -> list[Message]:
    pose = frame.message.pose.pose
    q = pose.orientation
    q.z, q.w = q.w, -q.z
    return [frame.message]


def standing(frame: Frame) -> list[Message]:
    """The ego says to drive and stays where it was, with new stamps."""
    return [stamped(frame.before, frame.now_ns)]


def once_routed(frame: Frame, lanelets: Sequence[int]) -> list[Message]:
    if frame.number > 0:
        return []
    frame.message.lanelet_ids = list(lanelets)
    return [frame.message]


def lane_twice(frame: Frame) -> list[Message]:
    frame.message.lanes = [*frame.message.lanes, frame.message.lanes[0]]
    return [frame.message]
