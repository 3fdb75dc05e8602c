# SPDX-License-Identifier: Apache-2.0
"""The faults that the planner must live with, as data: what happens, and what it must say.

A case disturbs one stream of messages. Reasons and levels are those on which the planner settles
while the fault lasts; what may be said on the way there is listed apart.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeAlias

from diagnostic_msgs.msg import DiagnosticStatus
from fault_disturbances import (
    Frame,
    Message,
    aside,
    at_times_the_rate,
    bow_tie,
    crowd,
    frozen,
    in_frame,
    jumping,
    lane_twice,
    late,
    lost,
    many_corners,
    moved_in_time,
    nobody,
    once_routed,
    rarely,
    replayed,
    standing,
    swapped,
    turned,
    twins,
    unset_stamp,
    with_corners,
    with_field,
)

from risk_dqn_planner.decision import Reason
from risk_dqn_planner.situation.report import FaultyInput
from sim_bridge.ros import topics

OK, WARN = DiagnosticStatus.OK, DiagnosticStatus.WARN
ERROR, STALE = DiagnosticStatus.ERROR, DiagnosticStatus.STALE

ODOMETRY, AREA, OBJECTS = FaultyInput.ODOMETRY, FaultyInput.VISIBLE_AREA, FaultyInput.OBJECTS
ROUTE, SITUATION = FaultyInput.ROUTE, FaultyInput.SITUATION
STREAMS = (ODOMETRY, AREA, OBJECTS)
INPUT_TOPICS = {
    ODOMETRY: topics.ODOMETRY,
    AREA: topics.VISIBLE_AREA,
    OBJECTS: topics.OBJECTS,
    ROUTE: topics.ROUTE,
    SITUATION: topics.SITUATION,
}
# Frames come every 0.1 s, decisions every 0.5 s: what is seen in a frame is told of by the next.
NEXT_DECISION_S = 0.5
# An input may be 0.5 s old, and the decision after that comes 0.5 s later at most.
OLD_S = 1.0
# All must be good for 1 s, then comes the next decision; what jumps back costs one frame more.
RECOVERY_S = 1.6
LASTS_FRAMES = 15


More: TypeAlias = Any  # further fields of a case


class Told(NamedTuple):
    """What a decision says is wrong."""

    reason: Reason
    source: FaultyInput


Disturb = Callable[[Frame], Iterable[Message]]


@dataclass(frozen=True)
class Case:
    """A fault of one stream.

    told: what decisions settle on, None where the planner must drive on. passing: what they may
    say before. frames: how many are disturbed at least. level: of the input's diagnostics.
    steady: what is told last while it lasts must be `told`; not so where good and bad messages
    alternate.
    """

    name: str
    source: FaultyInput
    disturb: Disturb
    told: Told | None
    passing: tuple[Told, ...] = ()
    reaction_s: float = NEXT_DECISION_S
    recovery_s: float = RECOVERY_S
    frames: int = LASTS_FRAMES
    level: bytes | None = None
    steady: bool = True

    @property
    def title(self) -> str:
        """Its name with that of the stream."""
        return f"{self.source}: {self.name}"

    @property
    def levels(self) -> Mapping[str, bytes]:
        """The diagnostics that are expected while it lasts."""
        if self.told is None:
            found = {"policy: decision": OK, "situation: situation": OK}
            return (
                found if self.level is None else {**found, f"situation: {self.source}": self.level}
            )
        found = {"policy: decision": ERROR}
        if self.source is not SITUATION:
            found["situation: situation"] = ERROR
            found[f"situation: {self.told.source}"] = self.level or ERROR
        return found


def _stale(source: FaultyInput) -> Told:
    return Told(Reason.STALE_INPUT, source)


def _case(source: FaultyInput, name: str, disturb: Disturb, reason: Reason, **more: More) -> Case:
    return Case(name, source, disturb, Told(reason, source), **more)


def _ignored(source: FaultyInput, name: str, disturb: Disturb, level: bytes = OK) -> Case:
    return Case(name, source, disturb, None, level=level)


# Without objects there is no situation, which the policy may notice first.
_SILENT = (_stale(SITUATION), Told(Reason.FROZEN_INPUT, SITUATION))
_NAN, _INF, _HUGE, _HUGE_32 = math.nan, math.inf, 1e300, 3e38


def _of_any_stream(source: FaultyInput) -> list[Case]:
    case, ignored = partial(_case, source), partial(_ignored, source)
    silent = _SILENT if source is OBJECTS else ()
    by_the_way = (_stale(source), *silent)
    old: dict[str, Any] = {"reaction_s": OLD_S, "passing": silent, "level": STALE}
    back = Told(Reason.OUT_OF_ORDER_INPUT, source)
    return [
        case("lost", lost, Reason.STALE_INPUT, **old),
        case("late by 1 s", late, Reason.STALE_INPUT, **{**old, "frames": 30}),
        case("frozen", frozen, Reason.FROZEN_INPUT, **{**old, "passing": by_the_way}),
        case("out of order", swapped, Reason.OUT_OF_ORDER_INPUT, reaction_s=0.6),
        case("played again", replayed, Reason.OUT_OF_ORDER_INPUT),
        ignored("at 10 times its rate", partial(at_times_the_rate, times=10)),
        ignored("at a third of its rate", partial(rarely, every=3), WARN),
        case("1 s ahead", partial(moved_in_time, by_s=1.0), Reason.FUTURE_INPUT, passing=(back,)),
        case("unset stamps", unset_stamp, Reason.FROZEN_INPUT, level=STALE,
             passing=(back, *by_the_way)),
        case("in another frame", partial(in_frame, name="odom"), Reason.WRONG_FRAME),
        case("in no frame", partial(in_frame, name=""), Reason.WRONG_FRAME),
    ]  # fmt: skip


def _of_odometry() -> list[Case]:
    case, field_of = partial(_case, ODOMETRY), partial
    x, v = "pose.pose.position.x", "twist.twist.linear.x"
    jump = Told(Reason.IMPLAUSIBLE_JUMP, ODOMETRY)
    off = {"passing": (jump,)}
    return [
        case("position NaN", field_of(with_field, path=x, value=_NAN), Reason.NOT_FINITE),
        case("position infinite", field_of(with_field, path=x, value=_INF), Reason.NOT_FINITE),
        case("position huge", field_of(with_field, path=x, value=_HUGE), Reason.OFF_ROUTE, **off),
        case("speed NaN", field_of(with_field, path=v, value=_NAN), Reason.NOT_FINITE),
        case("speed infinite", field_of(with_field, path=v, value=-_INF), Reason.NOT_FINITE),
        case("speed huge", field_of(with_field, path=v, value=_HUGE), Reason.IMPLAUSIBLE_SPEED),
        case("speed of 50 m/s", field_of(with_field, path=v, value=50.0), Reason.IMPLAUSIBLE_SPEED),
        case("orientation unset", field_of(with_field, path="pose.pose.orientation.w", value=0.0),
             Reason.MALFORMED_INPUT),
        case("orientation NaN", field_of(with_field, path="pose.pose.orientation.z", value=_NAN),
             Reason.NOT_FINITE),
        case("says to drive but stands", standing, Reason.FROZEN_INPUT, reaction_s=1.6, frames=25,
             passing=(jump,)),
        case("ego 8 m beside its route", field_of(aside, by_m=8.0), Reason.OFF_ROUTE, **off),
        case("ego faces the wrong way", turned, Reason.WRONG_WAY, **off),
        case("ego elsewhere for one frame", field_of(aside, by_m=1.9), Reason.IMPLAUSIBLE_JUMP,
             frames=1),
    ]  # fmt: skip


def _of_area() -> list[Case]:
    case = partial(_case, AREA)
    bad = Reason.INVALID_VISIBLE_AREA
    line = [(0.0, 0.0), (50.0, 0.0), (100.0, 0.0), (20.0, 0.0)]
    return [
        case("a corner NaN", partial(with_field, path="polygon.points.3.x", value=_NAN),
             Reason.NOT_FINITE),
        case("a corner infinite", partial(with_field, path="polygon.points.3.y", value=_INF),
             Reason.NOT_FINITE),
        case("a corner huge", partial(with_field, path="polygon.points.3.x", value=_HUGE_32), bad),
        case("empty", partial(with_corners, corners=[]), bad),
        case("two corners", partial(with_corners, corners=line[:2]), bad),
        case("without extent", partial(with_corners, corners=line), bad),
        case("one point repeated", partial(with_corners, corners=[(5.0, 5.0)] * 6), bad),
        case("crossing itself", bow_tie, bad),
        _ignored(AREA, "500 corners", partial(many_corners, count=500)),
        case("5000 corners", partial(many_corners, count=5000), bad),
    ]  # fmt: skip


def _of_objects() -> list[Case]:
    case, ignored = partial(_case, OBJECTS), partial(_ignored, OBJECTS)
    first = "objects.0."
    return [
        case("a position NaN", partial(with_field, path=first + "x_m", value=_NAN),
             Reason.NOT_FINITE),
        case("a position infinite", partial(with_field, path=first + "y_m", value=-_INF),
             Reason.NOT_FINITE),
        case("a position huge", partial(with_field, path=first + "x_m", value=_HUGE),
             Reason.MALFORMED_INPUT,
            passing=(Told(Reason.IMPLAUSIBLE_JUMP, OBJECTS),)),
        case("a heading NaN", partial(with_field, path=first + "heading_rad", value=_NAN),
             Reason.NOT_FINITE),
        case("a heading huge", partial(with_field, path=first + "heading_rad", value=_HUGE),
             Reason.MALFORMED_INPUT),
        case("a speed NaN", partial(with_field, path=first + "speed_mps", value=_NAN),
             Reason.NOT_FINITE),
        case("a speed huge", partial(with_field, path=first + "speed_mps", value=_HUGE),
             Reason.IMPLAUSIBLE_SPEED),
        case("a size infinite", partial(with_field, path=first + "length_m", value=_INF),
             Reason.NOT_FINITE),
        case("a size huge", partial(with_field, path=first + "length_m", value=_HUGE),
             Reason.INVALID_SIZE),
        case("a size negative", partial(with_field, path=first + "width_m", value=-2.0),
             Reason.INVALID_SIZE),
        case("duplicate ids", twins, Reason.DUPLICATE_ID),
        case("one jumps to and fro", partial(jumping, by_m=60.0), Reason.IMPLAUSIBLE_JUMP),
        ignored("empty lists", nobody),
        ignored("500 objects", partial(crowd, count=500)),
        case("1500 objects", partial(crowd, count=1500), Reason.INVALID_SIZE),
    ]  # fmt: skip


def _of_route() -> list[Case]:
    def case(name: str, lanelets: Sequence[int], told: Told, **more: More) -> Case:
        disturb = partial(once_routed, lanelets=lanelets)
        return Case(name, ROUTE, disturb, told, reaction_s=NEXT_DECISION_S + 0.1, **more)

    bad = Told(Reason.BAD_ROUTE, ROUTE)
    off = {"level": ERROR, "recovery_s": RECOVERY_S}
    return [
        case("a lanelet that is not on the map", [1, 424242, 4], bad),
        case("lanelets that do not follow", [1, 4], bad),
        case("empty", [], bad),
        case("a lanelet of a negative id", [-1], bad),
        case("100 000 lanelets", [1, 9, 4] * 33_333, bad),
        case("of another arm", OTHER_ROUTE, Told(Reason.OFF_ROUTE, ODOMETRY), **off),
    ]


# Straight across the four-way crossing from the arm to the left or right.
OTHER_ROUTE = (5, 11, 8)


def _of_situation() -> list[Case]:
    # Whether it comes before or after the node's own, and is read at all, is a matter of luck.
    case = partial(_case, SITUATION, reaction_s=2.0 * NEXT_DECISION_S)
    numbers = ("ego_speed_mps", "stop_line_distance_m", "goal_distance_m")
    malformed = Reason.MALFORMED_INPUT
    return [
        *(case(f"{name} NaN", partial(with_field, path=name, value=_NAN), Reason.NOT_FINITE)
          for name in numbers),
        case("a lane's distance infinite",
             partial(with_field, path="lanes.0.hidden_distance_m", value=_INF), Reason.NOT_FINITE),
        case("unknown status", partial(with_field, path="status", value=200), malformed),
        case("unknown input", partial(with_field, path="faulty_input", value=200), malformed),
        case("a vehicle on no lane",
             partial(with_field, path="vehicles.0.lane_id", value=424242), malformed),
        case("a lane twice", lane_twice, malformed),
        case("1 s ahead", partial(moved_in_time, by_s=1.0), Reason.FUTURE_INPUT,
             steady=False, passing=(Told(Reason.OUT_OF_ORDER_INPUT, SITUATION),)),
        case("back by 0.3 s", partial(moved_in_time, by_s=-0.3), Reason.OUT_OF_ORDER_INPUT,
             steady=False, passing=(_stale(SITUATION),)),
    ]  # fmt: skip


CASES = (
    *(case for source in STREAMS for case in _of_any_stream(source)),
    *_of_odometry(),
    *_of_area(),
    *_of_objects(),
    *_of_route(),
    *_of_situation(),
)
