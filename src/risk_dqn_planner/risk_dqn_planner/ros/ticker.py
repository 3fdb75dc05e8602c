# SPDX-License-Identifier: Apache-2.0
"""When decisions are due: by the steady clock in real time, by /clock in simulated time.

In real time a system clock that is set anew must not silence anybody. In simulated time decisions
fall on multiples of the period, and wait a little for their situation; while the clock stands,
the steady clock takes over.
"""

import time
from typing import Protocol

from rclpy.node import Node
from rclpy.timer import Timer

from risk_dqn_planner.ros.clock import is_simulated, now_ns, steady_timer
from risk_dqn_planner.ros.streams import SECOND_NS

_WATCH_PERIOD_S = 0.1
_STANDING_PERIOD_NS = SECOND_NS // 2


class Decides(Protocol):
    """Who takes the decisions."""

    def decide(self, stamp_ns: int) -> None:
        """Take the decision of a time [ns]."""

    def has_reached(self, stamp_ns: int) -> bool:
        """Tell whether the situation of this time or a later one is there."""

    def clock_stands(self, stamp_ns: int, stood_s: float) -> None:
        """Take a decision although the clock has shown the same time for `stood_s`."""


class Ticker:
    """Asks for decisions while it runs."""

    def __init__(self, node: Node, decides: Decides) -> None:
        self._node = node
        self._decides = decides
        self._timers: list[Timer] = []
        self._patience: Timer | None = None
        self._pace = (0.0, 0.0)
        self._due_ns: int | None = None  # time of a decision that waits for its situation
        self.clock_timeout_s = 0.5
        self._time_ns = self._since_ns = self._decided_ns = 0  # since, decided: steady clock

    @property
    def running(self) -> bool:
        """Whether it asks for decisions."""
        return bool(self._timers)

    def start(self, rate_hz: float, patience_s: float) -> None:
        """Ask `rate_hz` times a second from now on; the next decision is not put off by it."""
        pace = (rate_hz, patience_s)
        if self.running and pace == self._pace:
            return
        self.stop()
        self._pace = pace
        period_s = 1.0 / rate_hz
        if not is_simulated(self._node):
            self._timers = [steady_timer(self._node, period_s, self._on_tick)]
            return
        self._since_ns = time.monotonic_ns()
        self._timers = [
            self._node.create_timer(period_s, self._on_tick),
            steady_timer(self._node, _WATCH_PERIOD_S, self._watch),
        ]
        if patience_s > 0.0:
            self._patience = steady_timer(self._node, patience_s, self._decide_now)
            self._patience.cancel()

    def stop(self) -> None:
        """Ask no more."""
        patience = [] if self._patience is None else [self._patience]
        for timer in (*self._timers, *patience):
            timer.cancel()
            self._node.destroy_timer(timer)
        self._timers, self._patience, self._due_ns = [], None, None

    def situation_came(self) -> None:
        """Take the decision that waits for its situation, if this is it."""
        if self._due_ns is not None and self._decides.has_reached(self._due_ns):
            self._decide_now()

    def _on_tick(self) -> None:
        """Decide; in simulated time only once the situation of this very moment is there.

        Clock and situation are different topics, and either may win the race.
        """
        self._decide_now()
        self._due_ns = now_ns(self._node)
        patience = self._patience
        if patience is not None and not self._decides.has_reached(self._due_ns):
            patience.reset()
        else:
            self._decide_now()

    def _decide_now(self) -> None:
        """Take the decision that is due, if one is."""
        if self._patience is not None:
            self._patience.cancel()
        due_ns, self._due_ns = self._due_ns, None
        if due_ns is not None:
            self._decided_ns = time.monotonic_ns()
            self._decides.decide(due_ns)

    def _watch(self) -> None:
        """Decide although the clock stands."""
        steady_ns, clock_ns = time.monotonic_ns(), now_ns(self._node)
        if clock_ns != self._time_ns:
            self._time_ns, self._since_ns = clock_ns, steady_ns
        stood_ns = steady_ns - self._since_ns
        # Before its first message there is no time that others could mistake the decision's for.
        timeout_s = self.clock_timeout_s if clock_ns > 0 else 0.0
        if stood_ns < timeout_s * SECOND_NS:
            return
        if steady_ns - self._decided_ns >= _STANDING_PERIOD_NS:
            self._decided_ns = steady_ns
            self._decides.clock_stands(clock_ns, stood_ns / SECOND_NS)
