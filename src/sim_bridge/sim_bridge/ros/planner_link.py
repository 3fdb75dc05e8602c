# SPDX-License-Identifier: Apache-2.0
"""The planner as its surroundings see it: they give it time and collect its answers."""

import threading
import time
from collections.abc import Callable
from typing import Generic, TypeVar

from intersection_msgs.msg import Decision, Situation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rosgraph_msgs.msg import Clock

from risk_dqn_planner.ros.conversions import to_ns, to_stamp
from risk_dqn_planner.ros.qos import NEWEST
from risk_dqn_planner.ros.streams import SECOND_NS

DECISION_PERIOD_NS = SECOND_NS // 2
# Between episodes this much time passes without inputs, so that the planner forgets the last one.
EPISODE_GAP_NS = 2 * SECOND_NS
# The first episode starts at a multiple of this, however long the planner took to come up.
_START_NS = 10 * SECOND_NS
_FIRST_ANSWER_S = 1.0
_LOOK_AGAIN_S = 0.02

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


def _has_heard(decision: Decision) -> bool:
    """Whether the policy knows what the situation node says."""
    return decision.faulty_input not in {Decision.SITUATION, Decision.CLOCK}


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
            if not (self.connected() and inputs_are_read() and self._policy_is_loaded()):
                time.sleep(_LOOK_AGAIN_S)
                continue
            self._met_ns += DECISION_PERIOD_NS
            self.tick(self._met_ns)
            decision = self.decisions.wait(self._met_ns, _FIRST_ANSWER_S)
            if decision is not None and _has_heard(decision):
                return (self._met_ns + EPISODE_GAP_NS) // _START_NS * _START_NS + _START_NS
        return None

    def _policy_is_loaded(self) -> bool:
        """Whether the policy is there: without a time, too, it says what is missing."""
        decision = self.decisions.newest()[1]
        return decision is not None and decision.reason != Decision.POLICY_NOT_READY

    def close(self) -> None:
        """Stop waiting for answers."""
        self.closed = True
        self.situations.close()
        self.decisions.close()
