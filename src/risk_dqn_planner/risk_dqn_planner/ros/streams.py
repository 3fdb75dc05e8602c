# SPDX-License-Identifier: Apache-2.0
"""When messages of one input come: their age, order and rate. Plain Python, without ROS 2.

Ages are differences of stamps, never times of arrival; the steady clock only tells whether
messages still come. So a clock that stands still, or runs fast, makes no fault of its own.
"""

from collections import Counter, deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.situation.report import Fault, FaultyInput, Status
from risk_dqn_planner.vehicle import require_in_range

SECOND_NS = 1_000_000_000
RATES = "rates."  # of parameters
# Rates are told of the newest messages, these many at most and as old at most.
_RATED_MESSAGES = 100
_RATED_NS = 2 * SECOND_NS
_FEWEST_RATED = 5


@dataclass(frozen=True)
class AgeLimits:
    """How old an input may be, and how far ahead of the clock."""

    max_input_age_s: float = field(
        default=0.5,
        metadata={
            "description": "An input older than this, compared with the objects or with the "
            "clock, is a fault [s]",
            "minimum": 0.01,
            "maximum": 10.0,
            "live": True,
        },
    )
    max_input_ahead_s: float = field(
        default=0.2,
        metadata={
            "description": "An input further ahead of the clock than this is a fault [s]",
            "minimum": 0.0,
            "maximum": 10.0,
            "live": True,
        },
    )

    def __post_init__(self) -> None:
        require_in_range(self)

    @property
    def max_age_ns(self) -> int:
        """The greatest age [ns]."""
        return round(self.max_input_age_s * SECOND_NS)

    @property
    def max_ahead_ns(self) -> int:
        """The greatest lead [ns]."""
        return round(self.max_input_ahead_s * SECOND_NS)


@dataclass(frozen=True)
class RateLimits:
    """Between which rates an input is as expected; others are a warning, no fault."""

    min_rate_hz: float = field(
        default=4.0,
        metadata={
            "description": "A lower rate of messages is a warning in /diagnostics [Hz]",
            "minimum": 0.0,
            "maximum": 1000.0,
            "live": True,
        },
    )
    max_rate_hz: float = field(
        default=120.0,
        metadata={
            "description": "A higher rate of messages is a warning in /diagnostics [Hz]",
            "minimum": 0.1,
            "maximum": 1000.0,
            "live": True,
        },
    )

    def __post_init__(self) -> None:
        if not 0.0 <= self.min_rate_hz < self.max_rate_hz:
            raise ConfigurationError(
                f"RateLimits.min_rate_hz is {self.min_rate_hz}, expected 0 or more and less than "
                f"max_rate_hz ({self.max_rate_hz})"
            )


@dataclass(frozen=True)
class InputRates:
    """The expected rates of all inputs of the situation node."""

    odometry: RateLimits = field(default_factory=RateLimits)
    visible_area: RateLimits = field(default_factory=RateLimits)
    objects: RateLimits = field(default_factory=RateLimits)

    def of(self, source: FaultyInput) -> RateLimits:
        """Return the rates of one input."""
        limits: RateLimits = getattr(self, source.name.lower())
        return limits


@dataclass(frozen=True)
class SituationRates:
    """The expected rate of the policy node's input, which is that of the objects."""

    situation: RateLimits = field(default_factory=RateLimits)


class Stamped(NamedTuple):
    """A message with its own time [ns]."""

    stamp_ns: int
    message: Any


class Stream:
    """The newest message of an input, and when it and those before it came."""

    def __init__(self, source: FaultyInput, limits: AgeLimits) -> None:
        self.source = source
        self.limits = limits
        self.newest: Stamped | None = None
        self.last_fault: Fault | None = None
        self.faults: Counter[str] = Counter()
        self.received = 0
        self._arrived_ns = 0  # on the steady clock
        self._repeats = 0  # of the newest stamp
        self._stamps: deque[int] = deque(maxlen=_RATED_MESSAGES)

    def receive(self, stamp_ns: int, message: Any, now_ns: int, steady_ns: int) -> Fault | None:  # noqa: ANN401
        """Take a message; what is wrong with its stamp is returned once, then its time counts."""
        before, self.newest = self.newest, Stamped(stamp_ns, message)
        self.received += 1
        self._arrived_ns = steady_ns
        self._repeats = 0 if before is None or stamp_ns != before.stamp_ns else self._repeats + 1
        if before is not None and stamp_ns < before.stamp_ns:
            self._stamps.clear()
            self._stamps.append(stamp_ns)
            back_s = (before.stamp_ns - stamp_ns) / SECOND_NS
            text = f"{self.source} went back in time by {back_s:.3f} s, expected rising stamps"
            return self._fault(stamp_ns, Status.OUT_OF_ORDER_INPUT, text)
        self._stamps.append(stamp_ns)
        return self._ahead(stamp_ns, now_ns)

    def note(self, fault: Fault) -> None:
        """Keep a fault of this input for the diagnostics."""
        self.last_fault = fault
        self.faults[fault.status.name] += 1

    def overdue(self, reference_ns: int, now_ns: int, steady_ns: int) -> Fault | None:
        """Return what is wrong with the newest message at a time on the clock of the stamps [ns].

        reference_ns: what its age is compared with.
        """
        if self.newest is None:
            text = f"no {self.source} received yet"
            return self._fault(reference_ns, Status.MISSING_INPUT, text)
        age_ns, limit_s = reference_ns - self.newest.stamp_ns, self.limits.max_input_age_s
        if age_ns <= self.limits.max_age_ns:
            return self._ahead(reference_ns, now_ns)
        age = f"{age_ns / SECOND_NS:.2f} s old, expected at most {limit_s:g} s"
        if self._repeats > 0 and steady_ns - self._arrived_ns <= self.limits.max_age_ns:
            text = f"{self.source} keeps coming with the same stamp, {age}"
            return self._fault(reference_ns, Status.FROZEN_INPUT, text)
        return self._fault(reference_ns, Status.STALE_INPUT, f"{self.source} is {age}")

    def age_s(self, now_ns: int) -> float | None:
        """Return how old the newest message is [s], None if there is none."""
        return None if self.newest is None else (now_ns - self.newest.stamp_ns) / SECOND_NS

    def rate_hz(self) -> float | None:
        """Return the rate of the newest messages by their stamps, None if there are too few."""
        if not self._stamps:
            return None
        newest_ns = self._stamps[-1]
        recent = [stamp_ns for stamp_ns in self._stamps if newest_ns - stamp_ns <= _RATED_NS]
        if len(recent) < _FEWEST_RATED:
            return None
        span_ns = newest_ns - recent[0]
        return (len(recent) - 1) * SECOND_NS / span_ns if span_ns > 0 else 0.0

    def forget_later_than(self, latest_ns: int) -> None:
        """Forget a message of a time that has not come yet."""
        if self.newest is not None and self.newest.stamp_ns > latest_ns:
            self.newest = None
            self._stamps.clear()

    def _ahead(self, stamp_ns: int, now_ns: int) -> Fault | None:
        ahead_ns = 0 if self.newest is None else self.newest.stamp_ns - now_ns
        if ahead_ns <= self.limits.max_ahead_ns:
            return None
        text = (
            f"{self.source} is {ahead_ns / SECOND_NS:.2f} s ahead of the clock, "
            f"expected at most {self.limits.max_input_ahead_s:g} s"
        )
        return self._fault(stamp_ns, Status.FUTURE_INPUT, text)

    def _fault(self, stamp_ns: int, kind: Status, text: str) -> Fault:
        return Fault(stamp_ns, kind, self.source, text)
