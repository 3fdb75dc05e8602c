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
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from intersection_msgs.msg import Decision, Situation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from risk_dqn_planner.ros.conversions import SECOND_NS, to_ns, to_stamp
from risk_dqn_planner.ros.qos import NEWEST

DECISION_PERIOD_NS = SECOND_NS // 2
# A decision older than this no longer moves the ego when the simulator runs in real time.
OLDEST_DECISION_S = 1.0
# Nodes read /clock best effort: a lost time is sent again while an answer to it is awaited.
_CLOCK_AGAIN_S = 0.1
_FIRST_ANSWER_S = 1.0
_LOOK_AGAIN_S = 0.02
# Between episodes this much time passes without inputs, so that the planner forgets the last one.
EPISODE_GAP_NS = 2 * SECOND_NS
# The first episode starts at a multiple of this, however long the planner took to come up.
_START_NS = 10 * SECOND_NS

Message = TypeVar("Message")


class Mailbox(Generic[Message]):
    """The newest message of a topic, by its stamp; one thread delivers, another waits."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._stamp_ns = -1
        self._message: Message | None = None
        self._closed = False

    def put(self, stamp_ns: int, message: Message) -> None:
        """Deliver a message and wake whoever waits; an older one than the newest is dropped."""
        with self._changed:
            if stamp_ns >= self._stamp_ns:
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
        self._met_ns = 0
        self._node = node
        self._clock = node.create_publisher(Clock, "/clock", QoSProfile(depth=10))
        self._situations_from = node.create_subscription(
            Situation, situation_topic, self._on_situation, NEWEST
        )
        self._decisions_from = node.create_subscription(
            Decision, decision_topic, self._on_decision, NEWEST
        )

    def _on_situation(self, message: Situation) -> None:
        self.situations.put(to_ns(message.header.stamp), message)

    def _on_decision(self, message: Decision) -> None:
        self.decisions.put(to_ns(message.header.stamp), message)

    def tick(self, stamp_ns: int) -> None:
        """Publish the time."""
        self._clock.publish(Clock(clock=to_stamp(stamp_ns)))

    def connected(self) -> bool:
        """Whether somebody hears the clock and both answers can be heard."""
        topics = (self._situations_from.topic_name, self._decisions_from.topic_name)
        return self._clock.get_subscription_count() >= len(topics) and all(
            self._node.count_publishers(topic) > 0 for topic in topics
        )

    def meet(self, inputs_are_read: Callable[[], bool], timeout_s: float) -> int | None:
        """Let time pass until the policy answers to what the situation node says.

        Returns a time [ns] at which an episode may start, None if the planner stays silent.
        """
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline and not self.closed:
            if not (self.connected() and inputs_are_read()):
                time.sleep(_LOOK_AGAIN_S)
                continue
            self._met_ns += DECISION_PERIOD_NS
            self.tick(self._met_ns)
            decision = self.decisions.wait(self._met_ns, _FIRST_ANSWER_S)
            if decision is not None and decision.reason != Decision.NO_SITUATION:
                return (self._met_ns + EPISODE_GAP_NS) // _START_NS * _START_NS + _START_NS
        return None

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
        self._held: Decision | None = None

    def reach(self, stamp_ns: int) -> None:
        """Wait for the situation of the frame, then let the clock show the frame's time."""
        self._link.situations.wait(stamp_ns, self._timeout_s)
        self._pace.reach(stamp_ns)
        self._link.tick(stamp_ns)

    def decision(self, stamp_ns: int) -> Decision | None:
        """Wait for the decision taken at this time on the situation of this time.

        Between multiples of the period the last one holds.
        """
        if stamp_ns % DECISION_PERIOD_NS == 0:
            found = self._await_decision(stamp_ns)
            late = found is None or to_ns(found.situation_stamp) != stamp_ns
            self._held = None if late else found
        return self._held

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


def pass_time(pacing: Pacing, from_ns: int, until_ns: int) -> None:
    """Let the time between two frames pass, each decision between them awaited in its turn."""
    first_ns = (from_ns // DECISION_PERIOD_NS + 1) * DECISION_PERIOD_NS
    for stamp_ns in range(first_ns, until_ns, DECISION_PERIOD_NS):
        pacing.skip_to(stamp_ns)
