# SPDX-License-Identifier: Apache-2.0
"""Who waits for whom: simulated time, the inputs of the planner, and its answers.

Simulator and bag replay hand the planner one frame of inputs after another and ask for a
decision every 0.5 s. In lock-step a frame stamped t is published while `/clock` still shows an
earlier time; the clock reaches t only after the situation of t is out. So when the policy's timer
fires at t it holds exactly that situation, however fast or slow the computer is. Timers of ROS
time count from time zero, hence decisions fall on multiples of the period.
"""

import time
from typing import Protocol

from intersection_msgs.msg import Decision

from risk_dqn_planner.ros.conversions import to_ns
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.planner_link import DECISION_PERIOD_NS, PlannerLink

# A decision older than this no longer moves the ego when the simulator runs in real time.
OLDEST_DECISION_S = 1.0
# Nodes read /clock best effort: a lost time is sent again while an answer to it is awaited.
_CLOCK_AGAIN_S = 0.1
# Where nothing is awaited, nodes get this much time to see the clock and say so.
_NOTICE_S = 0.1
_PAUSE_STEP_NS = SECOND_NS // 10


class WallPace:
    """Keeps simulated time from running faster than wall time times a factor (0: no limit)."""

    def __init__(self, factor: float) -> None:
        self._factor = factor
        self._wall_s: float | None = None
        self._last_ns = 0

    def reach(self, stamp_ns: int) -> None:
        """Sleep until wall time allows simulated time to be `stamp_ns`."""
        now = time.monotonic()
        if self._factor > 0.0 and self._wall_s is not None:
            step_s = (stamp_ns - self._last_ns) / SECOND_NS / self._factor
            due = self._wall_s + step_s
            # Lost time is not caught up, or the world would rush after a hiccup.
            time.sleep(max(due - now, 0.0))
            now = max(now, due)
        self._wall_s, self._last_ns = now, stamp_ns


class Pacing(Protocol):
    """How simulated time and the planner's answers are tied together."""

    def reach(self, stamp_ns: int, *, complete: bool = True) -> None:
        """Let simulated time reach the frame whose inputs have just been published.

        complete: whether the objects were among them, so that there will be a situation.
        """

    def decision(self, stamp_ns: int) -> Decision | None:
        """Return the decision to obey from this time on, None if there is no valid one."""

    def pause(self, from_ns: int, until_ns: int) -> None:
        """Let the simulated time between two frames pass without inputs."""

    def close(self) -> None:
        """Stop waiting."""


class LockStep:
    """Simulated time waits for the planner: the same decisions on every computer."""

    def __init__(self, link: PlannerLink, pace: WallPace, timeout_s: float) -> None:
        self._link = link
        self._pace = pace
        self._timeout_s = timeout_s
        self._held: Decision | None = None
        self._answered = True
        self._complete = True

    def reach(self, stamp_ns: int, *, complete: bool = True) -> None:
        """Wait for the situation of the frame, then let the clock show the frame's time.

        While there is no answer, only frames that need a decision are waited for. Without
        objects there is no situation to wait for, but the nodes get time to notice that.
        """
        self._complete = complete
        if not complete:
            self._pace.reach(stamp_ns)
            self._link.tick(stamp_ns)
            time.sleep(_NOTICE_S)
            return
        needed = stamp_ns % DECISION_PERIOD_NS == 0
        timeout_s = self._timeout_s if needed or self._answered else 0.0
        self._answered = self._link.situations.wait(stamp_ns, timeout_s) is not None
        self._pace.reach(stamp_ns)
        self._link.tick(stamp_ns)

    def decision(self, stamp_ns: int) -> Decision | None:
        """Wait for the decision taken at this time on the situation of this time, if there is one.

        Between multiples of the period the last one holds.
        """
        if stamp_ns % DECISION_PERIOD_NS == 0:
            found = self._await_decision(stamp_ns)
            late = found is None or (self._complete and to_ns(found.situation_stamp) != stamp_ns)
            self._held = None if late else found
        return self._held

    def pause(self, from_ns: int, until_ns: int) -> None:
        """Jump to the last time at which a decision is due, and await it (it is Stop)."""
        last_ns = (until_ns - 1) // DECISION_PERIOD_NS * DECISION_PERIOD_NS
        if last_ns > from_ns:
            self._link.tick(last_ns)
            self._await_decision(last_ns)

    def close(self) -> None:
        """Stop waiting."""
        self._link.close()

    def _await_decision(self, stamp_ns: int) -> Decision | None:
        deadline = time.monotonic() + self._timeout_s
        while (left_s := deadline - time.monotonic()) > 0.0 and not self._link.closed:
            wait_s = min(left_s, _CLOCK_AGAIN_S)
            decision = self._link.decisions.wait(stamp_ns, wait_s)
            if decision is not None:
                return decision
            self._link.tick(stamp_ns)
        return None


class RealTime:
    """Simulated time follows the wall clock; the newest decision counts, like on a vehicle."""

    def __init__(self, link: PlannerLink, pace: WallPace) -> None:
        self._link = link
        self._pace = pace

    def reach(self, stamp_ns: int, *, complete: bool = True) -> None:  # noqa: ARG002
        """Let the clock show the frame's time when it is due."""
        self._pace.reach(stamp_ns)
        self._link.tick(stamp_ns)

    def decision(self, stamp_ns: int) -> Decision | None:
        """Return the newest decision unless it is too old."""
        decided_ns, decision = self._link.decisions.newest()
        if stamp_ns - decided_ns > OLDEST_DECISION_S * SECOND_NS:
            return None
        return decision

    def pause(self, from_ns: int, until_ns: int) -> None:
        """Let time pass at its pace."""
        for stamp_ns in range(from_ns + _PAUSE_STEP_NS, until_ns, _PAUSE_STEP_NS):
            self.reach(stamp_ns)

    def close(self) -> None:
        """Stop waiting."""
        self._link.close()
