# SPDX-License-Identifier: Apache-2.0
"""Who waits for whom: simulated time, the inputs of the planner, and its answers.

Simulator and bag replay hand the planner one frame of inputs after another and ask for a
decision every 0.5 s. In lock-step a frame stamped t is published while `/clock` still shows an
earlier time; the clock reaches t only after the situation of t is out. So when the policy's timer
fires at t it holds exactly that situation, however fast or slow the computer is. Timers of ROS
time count from time zero, hence decisions fall on multiples of the period.
"""

import threading
import time
from typing import Generic, Protocol, TypeVar

from builtin_interfaces.msg import Time
from intersection_msgs.msg import Decision, Situation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from risk_dqn_planner.ros.qos import NEWEST

SECOND_NS = 1_000_000_000
DECISION_PERIOD_NS = SECOND_NS // 2
# A decision older than this no longer moves the ego when the simulator runs in real time.
OLDEST_DECISION_S = 1.0
# Nodes read /clock best effort: a lost time is sent again while an answer to it is awaited.
_CLOCK_AGAIN_S = 0.1

Message = TypeVar("Message")


def to_ns(stamp: Time) -> int:
    """Nanoseconds of a builtin_interfaces/Time."""
    return int(stamp.sec) * SECOND_NS + int(stamp.nanosec)


def to_stamp(time_ns: int) -> Time:
    """A builtin_interfaces/Time of nanoseconds."""
    return Time(sec=time_ns // SECOND_NS, nanosec=time_ns % SECOND_NS)


class Mailbox(Generic[Message]):
    """The newest message of a topic, with its stamp; one thread delivers, another waits."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._stamp_ns = -1
        self._message: Message | None = None
        self._closed = False

    def put(self, stamp_ns: int, message: Message) -> None:
        """Deliver a message and wake whoever waits."""
        with self._changed:
            self._stamp_ns, self._message = stamp_ns, message
            self._changed.notify_all()

    def close(self) -> None:
        """Let every present and future wait return at once."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def wait(self, stamp_ns: int, timeout_s: float) -> Message | None:
        """Return the message with this stamp, or None if it does not come within the timeout."""
        with self._changed:
            self._changed.wait_for(
                lambda: self._closed or self._stamp_ns >= stamp_ns, timeout=timeout_s
            )
            return self._message if self._stamp_ns == stamp_ns else None

    def newest(self) -> tuple[int, Message | None]:
        """Return the newest message with its stamp [ns], (-1, None) if there is none."""
        with self._changed:
            return self._stamp_ns, self._message


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

    def reach(self, stamp_ns: int) -> None:
        """Let simulated time reach the frame whose inputs have just been published."""

    def decision(self, stamp_ns: int) -> Decision | None:
        """Return the decision to obey from this time on, None if there is no valid one."""

    def skip_to(self, stamp_ns: int) -> None:
        """Let simulated time pass without inputs."""

    def close(self) -> None:
        """Stop waiting."""


class PlannerLink:
    """Gives the planner its time and collects its answers."""

    def __init__(self, node: Node, situation_topic: str, decision_topic: str) -> None:
        self.situations: Mailbox[Situation] = Mailbox()
        self.decisions: Mailbox[Decision] = Mailbox()
        self.closed = False
        self._clock = node.create_publisher(Clock, "/clock", QoSProfile(depth=10))
        node.create_subscription(Situation, situation_topic, self._on_situation, NEWEST)
        node.create_subscription(Decision, decision_topic, self._on_decision, NEWEST)

    def _on_situation(self, message: Situation) -> None:
        self.situations.put(to_ns(message.header.stamp), message)

    def _on_decision(self, message: Decision) -> None:
        self.decisions.put(to_ns(message.header.stamp), message)

    def tick(self, stamp_ns: int) -> None:
        """Publish the time."""
        self._clock.publish(Clock(clock=to_stamp(stamp_ns)))

    def close(self) -> None:
        """Stop waiting for answers."""
        self.closed = True
        self.situations.close()
        self.decisions.close()


class LockStep:
    """Simulated time waits for the planner: the same decisions on every computer."""

    def __init__(self, link: PlannerLink, pace: WallPace, timeout_s: float) -> None:
        self._link = link
        self._pace = pace
        self._timeout_s = timeout_s

    def reach(self, stamp_ns: int) -> None:
        """Wait for the situation of the frame, then let the clock show the frame's time."""
        self._link.situations.wait(stamp_ns, self._timeout_s)
        self._pace.reach(stamp_ns)
        self._link.tick(stamp_ns)

    def decision(self, stamp_ns: int) -> Decision | None:
        """Wait for the decision taken at this time on the situation of this time."""
        decision = self._await_decision(stamp_ns)
        if decision is None or to_ns(decision.situation_stamp) != stamp_ns:
            return None
        return decision

    def skip_to(self, stamp_ns: int) -> None:
        """Jump to the time; the policy's decision then (there is no input) is awaited."""
        self._link.tick(stamp_ns)
        self._await_decision(stamp_ns)

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

    def reach(self, stamp_ns: int) -> None:
        """Let the clock show the frame's time when it is due."""
        self._pace.reach(stamp_ns)
        self._link.tick(stamp_ns)

    def decision(self, stamp_ns: int) -> Decision | None:
        """Return the newest decision unless it is too old."""
        decided_ns, decision = self._link.decisions.newest()
        if stamp_ns - decided_ns > OLDEST_DECISION_S * SECOND_NS:
            return None
        return decision

    def skip_to(self, stamp_ns: int) -> None:
        """Let time pass."""
        self.reach(stamp_ns)

    def close(self) -> None:
        """Stop waiting."""
        self._link.close()
