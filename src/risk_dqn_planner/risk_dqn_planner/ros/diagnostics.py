# SPDX-License-Identifier: Apache-2.0
"""A node's entries in /diagnostics: every second, and at once when one gets better or worse."""

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from risk_dqn_planner.ros.qos import DIAGNOSTICS

OK, WARN = DiagnosticStatus.OK, DiagnosticStatus.WARN
ERROR, STALE = DiagnosticStatus.ERROR, DiagnosticStatus.STALE


class Diagnostics:
    """Collects one status per concern and publishes them together."""

    def __init__(self, node: Node, hardware_id: str) -> None:
        self._node = node
        self._hardware_id = hardware_id
        self._statuses: dict[str, DiagnosticStatus] = {}
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", DIAGNOSTICS)

    def set(
        self, concern: str, level: bytes, message: str, values: Mapping[str, object] | None = None
    ) -> None:
        """Replace the status of a concern; a changed level goes out at once."""
        before = self._statuses.get(concern)
        status = DiagnosticStatus(
            level=level,
            name=f"{self._node.get_name()}: {concern}",
            message=message,
            hardware_id=self._hardware_id,
            values=[KeyValue(key=key, value=str(value)) for key, value in (values or {}).items()],
        )
        self._statuses[concern] = status
        if before is None or before.level != level:
            self.publish([status])

    def publish(self, statuses: list[DiagnosticStatus] | None = None) -> None:
        """Publish the given statuses, or all."""
        message = DiagnosticArray(status=statuses or list(self._statuses.values()))
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)


def freshness(age_s: float | None, max_age_s: float) -> tuple[bytes, str]:
    """Return level and message for an input of this age, None if it never came."""
    if age_s is None:
        return STALE, "never received"
    if age_s > max_age_s:
        return STALE, f"{age_s:.2f} s old, expected at most {max_age_s:g} s"
    return OK, "received"
