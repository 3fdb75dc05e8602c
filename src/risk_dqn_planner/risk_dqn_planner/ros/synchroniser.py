# SPDX-License-Identifier: Apache-2.0
"""Which inputs belong together: plain Python, so that it is tested without ROS 2.

Objects set the pace. Once a list of objects has arrived it waits until odometry and visible area
are as new as itself, but no longer than a timeout on the steady clock. Of what has come by then the
odometry before and after the objects serves, and the newest visible area that is not newer than
they are: one that is may show a place free for somebody who was hidden when the objects were
perceived. Ages are differences of stamps, never times of arrival, so the same frames come out with
a clock that stands still, jumps from tick to tick, or runs fast.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from risk_dqn_planner.ros.backlog import Backlog
from risk_dqn_planner.ros.streams import SECOND_NS, AgeLimits, Stamped, Stream
from risk_dqn_planner.situation.report import Fault, FaultyInput, Status
from risk_dqn_planner.vehicle import require_positive

# The streams of messages, in the order in which their faults are told.
INPUTS = (FaultyInput.ODOMETRY, FaultyInput.VISIBLE_AREA, FaultyInput.OBJECTS)


@dataclass(frozen=True)
class SynchroniserConfig:
    """How long inputs are waited for."""

    sync_timeout_s: float = field(
        default=0.05,
        metadata={
            "description": "Objects wait this long for odometry and visible area [s]",
            "minimum": 0.001,
            "maximum": 1.0,
            "live": True,
        },
    )

    def __post_init__(self) -> None:
        require_positive(self)


class Frame(NamedTuple):
    """Messages that belong together, at the time of the objects [ns].

    odometry: the message of that time, or the ones before and after it, as far as there are.
    """

    stamp_ns: int
    odometry: tuple[Any, ...]
    visible_area: Any
    objects: Any


class Synchroniser:
    """Holds the newest messages of each input and hands out frames."""

    def __init__(self, config: SynchroniserConfig, ages: AgeLimits) -> None:
        self._timeout_ns = 0
        self.streams = {source: Stream(source, ages) for source in INPUTS}
        self._backlogs = _new_backlogs()
        self.reconfigure(config, ages)
        self._deadline_ns: int | None = None  # on the steady clock; None if no objects wait
        self._event: Fault | None = None  # what a message was wrong with, until it is told

    def reconfigure(self, config: SynchroniserConfig, ages: AgeLimits) -> None:
        """Go by other limits from now on."""
        self._timeout_ns = int(config.sync_timeout_s * SECOND_NS)
        for stream in self.streams.values():
            stream.limits = ages

    def receive(
        self, source: FaultyInput, stamp_ns: int, message: object, now_ns: int, steady_ns: int
    ) -> None:
        """Take a message; now_ns is the time on the clock of the stamps.

        steady_ns: time of arrival, which counts for the timeout and for what comes no more.
        """
        fault = self.streams[source].receive(stamp_ns, message, now_ns, steady_ns)
        self._event = fault or self._event
        backlog = self._backlogs.get(source)
        if backlog is not None:
            # Inputs may be ahead of a clock by which objects are late, each as far as it may.
            limits = self.streams[source].limits
            kept_ns = limits.max_age_ns + max(limits.max_ahead_ns, 0)
            backlog.add(Stamped(stamp_ns, message), kept_ns)
        if source is FaultyInput.OBJECTS and self._deadline_ns is None:
            # Later lists do not put the deadline off, or a late input would stall everything.
            self._deadline_ns = steady_ns + self._timeout_ns

    def take(self, now_ns: int, steady_ns: int) -> Frame | Fault | None:
        """Return the frame that is due, or why there is none; None if nothing is due yet."""
        if self._event is not None:
            fault, self._event, self._deadline_ns = self._event, None, None
            return self._told(fault, now_ns)
        objects = self.streams[FaultyInput.OBJECTS].newest
        if self._deadline_ns is None or objects is None:
            return None
        stamp_ns = objects.stamp_ns
        newest = [self.streams[source].newest for source in INPUTS]
        behind = any(one is None or one.stamp_ns < stamp_ns for one in newest)
        if behind and steady_ns < self._deadline_ns:
            return None
        self._deadline_ns = None
        # Inputs may be ahead of a clock that waits for the answer, but not behind it.
        late = self._overdue(max(stamp_ns, now_ns), now_ns, steady_ns)
        if late is not None:
            return self._told(late._replace(stamp_ns=stamp_ns), now_ns)
        due = self._frame(objects)
        return self._told(due, now_ns) if isinstance(due, Fault) else due

    def _frame(self, objects: Stamped) -> Frame | Fault:
        """Return what belongs to objects, or what is missing or too old beside them."""
        stamp_ns, source = objects.stamp_ns, FaultyInput.VISIBLE_AREA
        area = self._backlogs[source].up_to(stamp_ns)
        if area is None:
            text = f"no {source} of the objects' time or before received yet"
            return Fault(stamp_ns, Status.MISSING_INPUT, source, text)
        limits = self.streams[source].limits
        if stamp_ns - area.stamp_ns > limits.max_age_ns:
            age_s = (stamp_ns - area.stamp_ns) / SECOND_NS
            text = (
                f"the last {source} before the objects is {age_s:.2f} s older, "
                f"expected at most {limits.max_input_age_s:g} s"
            )
            return Fault(stamp_ns, Status.STALE_INPUT, source, text)
        source = FaultyInput.ODOMETRY
        around = self._backlogs[source].around(stamp_ns)
        near = [one for one in around if abs(one.stamp_ns - stamp_ns) <= limits.max_age_ns]
        if not near:
            text = f"no {source} within {limits.max_input_age_s:g} s of the objects"
            return Fault(stamp_ns, Status.STALE_INPUT, source, text)
        odometry = tuple(one.message for one in near)
        return Frame(stamp_ns, odometry, area.message, objects.message)

    def begin_errand(self) -> None:
        """Forget where the ego was before, and what it saw from there."""
        for backlog in self._backlogs.values():
            backlog.keep_newest()

    def overdue(self, now_ns: int, steady_ns: int) -> Fault | None:
        """Return what is missing, too old or ahead by the clock of the stamps."""
        return self._overdue(now_ns, now_ns, steady_ns)

    def restart(self) -> None:
        """Forget every message."""
        for source, stream in self.streams.items():
            self.streams[source] = Stream(source, stream.limits)
        self._backlogs = _new_backlogs()
        self._event = self._deadline_ns = None

    def clock_went_back(self, now_ns: int) -> None:
        """Forget what is of a time that has not come yet."""
        for source, stream in self.streams.items():
            latest_ns = now_ns + stream.limits.max_age_ns
            stream.forget_later_than(latest_ns)
            if source in self._backlogs:
                self._backlogs[source].forget_later_than(latest_ns)
        self._event = None
        if self.streams[FaultyInput.OBJECTS].newest is None:
            self._deadline_ns = None

    def _told(self, fault: Fault, now_ns: int) -> Fault:
        """Return a fault as of now: whoever reads it shall not take it for old or early itself."""
        latest_ns = now_ns + self.streams[fault.source].limits.max_ahead_ns
        return fault._replace(stamp_ns=min(max(fault.stamp_ns, now_ns), latest_ns))

    def _overdue(self, reference_ns: int, now_ns: int, steady_ns: int) -> Fault | None:
        missing = [source for source in INPUTS if self.streams[source].newest is None]
        if missing:
            text = f"no {' and no '.join(str(source) for source in missing)} received yet"
            return Fault(reference_ns, Status.MISSING_INPUT, missing[0], text)
        faults = (
            self.streams[source].overdue(reference_ns, now_ns, steady_ns) for source in INPUTS
        )
        return next((fault for fault in faults if fault is not None), None)


def _new_backlogs() -> dict[FaultyInput, Backlog]:
    """Return what is kept beside the newest messages, of inputs that objects choose from."""
    return {FaultyInput.ODOMETRY: Backlog(), FaultyInput.VISIBLE_AREA: Backlog()}
