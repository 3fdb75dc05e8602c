# SPDX-License-Identifier: Apache-2.0
"""Which inputs belong together: plain Python, so that it is tested without ROS 2.

Objects set the pace. Once a list of objects has arrived it waits until odometry and visible area
are as new as itself, but no longer than a timeout on the steady clock; then the newest there is
serves, unless it is too old. Ages are differences of stamps, never times of arrival, so the same
frames come out with a clock that stands still, jumps from tick to tick, or runs fast.
"""

import enum
from dataclasses import dataclass, field
from typing import NamedTuple

from risk_dqn_planner.situation.report import Fault, FaultyInput, Status
from risk_dqn_planner.vehicle import require_positive

SECOND_NS = 1_000_000_000


class Input(enum.Enum):
    """The streams of messages; the values are their names in sentences."""

    ODOMETRY = "odometry"
    VISIBLE_AREA = "visible area"
    OBJECTS = "objects"

    @property
    def source(self) -> FaultyInput:
        """Its name in faults."""
        return FaultyInput[self.name]


@dataclass(frozen=True)
class SynchroniserConfig:
    """How long inputs are waited for and how old they may be."""

    sync_timeout_s: float = field(
        default=0.05,
        metadata={
            "description": "Objects wait this long for odometry and visible area [s]",
            "minimum": 0.001,
            "maximum": 1.0,
        },
    )
    max_input_age_s: float = field(
        default=0.5,
        metadata={
            "description": "An input older than this, compared with the objects or with the "
            "clock, is a fault [s]",
            "minimum": 0.01,
            "maximum": 10.0,
        },
    )

    def __post_init__(self) -> None:
        require_positive(self)


class Stamped(NamedTuple):
    """A message with its own time [ns]."""

    stamp_ns: int
    message: object


class Frame(NamedTuple):
    """Messages that belong together, at the time of the objects [ns]."""

    stamp_ns: int
    odometry: object
    visible_area: object
    objects: object


class Synchroniser:
    """Holds the newest message of each input and hands out frames."""

    def __init__(self, config: SynchroniserConfig) -> None:
        self._timeout_ns = int(config.sync_timeout_s * SECOND_NS)
        self._max_age_ns = int(config.max_input_age_s * SECOND_NS)
        self._newest: dict[Input, Stamped] = {}
        self._deadline_ns: int | None = None  # on the steady clock; None if no objects wait
        self._went_back: Fault | None = None

    def receive(self, source: Input, stamp_ns: int, message: object, steady_ns: int) -> None:
        """Take a message; `steady_ns` is the time of arrival, which counts for the timeout only."""
        last = self._newest.get(source)
        self._newest[source] = Stamped(stamp_ns, message)
        if last is not None and stamp_ns < last.stamp_ns:
            back_s = (last.stamp_ns - stamp_ns) / SECOND_NS
            text = f"{source.value} went back in time by {back_s:.3f} s, expected rising stamps"
            self._went_back = Fault(stamp_ns, Status.OUT_OF_ORDER_INPUT, source.source, text)
        if source is Input.OBJECTS and self._deadline_ns is None:
            # Later lists do not put the deadline off, or a late input would stall everything.
            self._deadline_ns = steady_ns + self._timeout_ns

    def take(self, steady_ns: int) -> Frame | Fault | None:
        """Return the frame that is due, or why there is none; None if nothing is due yet."""
        if self._went_back is not None:
            fault, self._went_back, self._deadline_ns = self._went_back, None, None
            return fault
        if self._deadline_ns is None:
            return None
        stamp_ns = self._newest[Input.OBJECTS].stamp_ns
        behind = [
            source
            for source in (Input.ODOMETRY, Input.VISIBLE_AREA)
            if source not in self._newest or self._newest[source].stamp_ns < stamp_ns
        ]
        if behind and steady_ns < self._deadline_ns:
            return None
        self._deadline_ns = None
        return self._fault(stamp_ns) or Frame(
            stamp_ns,
            self._newest[Input.ODOMETRY].message,
            self._newest[Input.VISIBLE_AREA].message,
            self._newest[Input.OBJECTS].message,
        )

    def overdue(self, now_ns: int) -> Fault | None:
        """Return what is missing or too old by the clock of the stamps."""
        fault = self._fault(now_ns)
        return None if fault is None else fault._replace(stamp_ns=now_ns)

    def age_s(self, source: Input, now_ns: int) -> float | None:
        """Return how old the newest message of an input is [s], None if there is none."""
        if source not in self._newest:
            return None
        return (now_ns - self._newest[source].stamp_ns) / SECOND_NS

    def clock_went_back(self, now_ns: int) -> None:
        """Forget what is of a time that has not come yet."""
        latest_ns = now_ns + self._max_age_ns
        self._newest = {k: v for k, v in self._newest.items() if v.stamp_ns <= latest_ns}
        self._went_back = None
        if Input.OBJECTS not in self._newest:
            self._deadline_ns = None

    def _fault(self, now_ns: int) -> Fault | None:
        missing = [source for source in Input if source not in self._newest]
        if missing:
            names = " and no ".join(source.value for source in missing)
            text = f"no {names} received yet"
            return Fault(now_ns, Status.MISSING_INPUT, missing[0].source, text)
        for source in Input:
            age_ns = now_ns - self._newest[source].stamp_ns
            if age_ns > self._max_age_ns:
                text = (
                    f"{source.value} is {age_ns / SECOND_NS:.2f} s old, "
                    f"expected at most {self._max_age_ns / SECOND_NS:g} s"
                )
                return Fault(now_ns, Status.STALE_INPUT, source.source, text)
        return None
