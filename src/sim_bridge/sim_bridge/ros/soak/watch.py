# SPDX-License-Identifier: Apache-2.0
"""Listens to a drive: episodes and decisions go into a ledger, errors are counted."""

import threading
import time
from collections import Counter

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from intersection_msgs.msg import Decision, EpisodeEvent
from rclpy.node import Node
from rclpy.qos import QoSProfile

from risk_dqn_planner.policies.base import Reason
from risk_dqn_planner.ros.conversions import to_ns
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.soak.ledger import Ledger
from sim_bridge.ros.summary import RESULTS
from sim_bridge.ros.topics import DECISION, EPISODE

_DEPTH = 1000


class Watch:
    """What is said while nodes drive; its callbacks run in the session's thread."""

    def __init__(self, node: Node) -> None:
        self._lock = threading.Lock()
        self._ledger = Ledger()
        self._errors: Counter[str] = Counter()
        self._level: dict[str, bytes] = {}
        self._first_ns: int | None = None
        self._newest_ns = 0
        self._heard_s = time.monotonic()
        for topic, react in ((DECISION, self._on_decision), (EPISODE, self._on_episode)):
            qos = QoSProfile(depth=_DEPTH, reliability=topic.qos.reliability)
            node.create_subscription(topic.message, topic.name, react, qos)
        qos = QoSProfile(depth=_DEPTH)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, qos)

    def _on_decision(self, message: Decision) -> None:
        reason, stamp_ns = Reason(message.reason), to_ns(message.header.stamp)
        with self._lock:
            self._ledger.decided(stamp_ns, reason.name if reason.is_fault else None)
            self._newest_ns = max(self._newest_ns, stamp_ns)
            self._heard_s = time.monotonic()

    def _on_episode(self, message: EpisodeEvent) -> None:
        stamp_ns = to_ns(message.header.stamp)
        with self._lock:
            if self._first_ns is None:
                self._first_ns = stamp_ns
            if message.event == EpisodeEvent.STARTED:
                self._ledger.started(stamp_ns)
            else:
                self._ledger.ended(stamp_ns, RESULTS[message.event], message.late_decisions)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        """Count how often a status turns into an error."""
        with self._lock:
            for status in message.status:
                before = self._level.get(status.name, DiagnosticStatus.OK)
                if status.level == DiagnosticStatus.ERROR != before:
                    self._errors[status.name] += 1
                self._level[status.name] = status.level

    def driven_s(self) -> float:
        """Return the simulated time since the first episode began [s], 0 before."""
        with self._lock:
            if self._first_ns is None:
                return 0.0
            return max(0, self._newest_ns - self._first_ns) / SECOND_NS

    def silent_s(self) -> float:
        """Return for how long no decision has come [s of real time]."""
        with self._lock:
            return time.monotonic() - self._heard_s

    def result(self) -> tuple[Ledger, Counter[str]]:
        """Return the ledger, and how often which diagnostic status turned into an error."""
        with self._lock:
            return self._ledger, Counter(self._errors)
