# SPDX-License-Identifier: Apache-2.0
"""Listens to a running simulation and keeps one episode's messages, still serialised."""

import threading
import time
from collections.abc import Callable

from intersection_msgs.msg import EpisodeEvent
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.ros.conversions import to_ns
from sim_bridge.ros.planner_link import DECISION_PERIOD_NS
from sim_bridge.ros.recording import Stored, stamp_of
from sim_bridge.ros.topics import ALL, DECISION, EPISODE, ROUTE, Topic

# Reading must not lag so far behind that a message is overwritten before it is stored.
_DEPTH = 1000
_LOOK_AGAIN_S = 0.2


class EpisodeStuckError(PlannerError):
    """A simulated episode neither went on nor ended."""


class Observer:
    """Keeps what is said on all topics from an episode's start event to its end event."""

    def __init__(self, node: Node) -> None:
        self._changed = threading.Condition()
        self._messages: list[Stored] = []
        self._newest_ns: dict[str, int] = {}
        self._end: EpisodeEvent | None = None
        self._node = node
        for topic in ALL:
            qos = QoSProfile(
                depth=_DEPTH, reliability=topic.qos.reliability, durability=topic.qos.durability
            )
            node.create_subscription(
                topic.message, topic.name, self._listener(topic), qos, raw=True
            )

    def connected(self) -> bool:
        """Whether somebody speaks on every topic."""
        return all(self._node.count_publishers(topic.name) > 0 for topic in ALL)

    def _listener(self, topic: Topic) -> Callable[[bytes], None]:
        def listen(data: bytes) -> None:
            with self._changed:
                self._keep(topic, Stored(stamp_of(data), topic.name, data))
                self._changed.notify_all()

        return listen

    def _keep(self, topic: Topic, message: Stored) -> None:
        self._newest_ns[topic.name] = message.stamp_ns
        self._messages.append(message)
        if topic is EPISODE:
            event = deserialize_message(message.data, EpisodeEvent)
            if event.event != EpisodeEvent.STARTED:
                self._end = event

    def begin(self) -> None:
        """Forget the last episode; call before the next one is asked for."""
        with self._changed:
            self._messages.clear()
            self._end = None

    def wait_for_end(self, patience_s: float, check: Callable[[], None]) -> EpisodeEvent:
        """Wait until the episode has ended and all that belongs to it has arrived.

        `check` is called again and again meanwhile and raises if waiting has become pointless.

        Raises:
            EpisodeStuckError: nothing new arrived for `patience_s`.
        """
        seen, since = 0, time.monotonic()
        while True:
            with self._changed:
                self._changed.wait_for(self._complete, timeout=_LOOK_AGAIN_S)
                if self._end is not None and self._complete():
                    return self._end
                count = len(self._messages)
            check()
            if count > seen:
                seen, since = count, time.monotonic()
            elif time.monotonic() - since > patience_s:
                raise EpisodeStuckError(
                    f"the simulator has sent nothing for {patience_s:g} s, expected an episode"
                )

    def _complete(self) -> bool:
        if self._end is None:
            return False
        end_ns = to_ns(self._end.header.stamp)
        last_decision_ns = end_ns // DECISION_PERIOD_NS * DECISION_PERIOD_NS
        return all(
            self._newest_ns.get(topic.name, -1)
            >= (last_decision_ns if topic is DECISION else end_ns)
            for topic in ALL
            if topic is not ROUTE
        )

    def episode(self) -> list[Stored]:
        """Messages of the episode that has ended, those between episodes left out."""
        with self._changed:
            starts = [m for m in self._messages if m.topic == EPISODE.name]
            first_ns = starts[0].stamp_ns
            last_ns = starts[-1].stamp_ns
            return [m for m in self._messages if first_ns <= m.stamp_ns <= last_ns]
