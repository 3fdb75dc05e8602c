# SPDX-License-Identifier: Apache-2.0
"""A node's entries in /diagnostics: every second, and at once when one gets better or worse."""

from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from risk_dqn_planner.ros.qos import DIAGNOSTICS
from risk_dqn_planner.ros.streams import SECOND_NS, RateLimits, Stream

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

    def is_well(self, concern: str) -> bool:
        """Tell whether nothing is known against a concern."""
        status = self._statuses.get(concern)
        return status is None or status.level == OK

    def publish(self, statuses: list[DiagnosticStatus] | None = None) -> None:
        """Publish the given statuses, or all."""
        message = DiagnosticArray(status=statuses or list(self._statuses.values()))
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)


def stream_status(
    stream: Stream, now_ns: int, rates: RateLimits, recent_ns: int = SECOND_NS
) -> tuple[bytes, str, dict[str, object]]:
    """Return level, message and values for an input.

    A fault that was noted is told of for as long as it is recent.
    """
    age_s, rate_hz, fault = stream.age_s(now_ns), stream.rate_hz(), stream.last_fault
    values: dict[str, object] = {
        "age_s": age_s,
        "rate_hz": None if rate_hz is None else round(rate_hz, 2),
        "received": stream.received,
        "faults": dict(stream.faults),
        "last_fault": "" if fault is None else fault.text,
    }
    if age_s is None:
        return STALE, "never received", values
    if age_s > stream.limits.max_input_age_s:
        limit_s = stream.limits.max_input_age_s
        return STALE, f"{age_s:.2f} s old, expected at most {limit_s:g} s", values
    # Faults may be stamped ahead of the clock, but one of before the clock went back is over.
    if fault is not None and abs(now_ns - fault.stamp_ns) <= recent_ns:
        return ERROR, f"{fault.status.name}: {fault.text}", values
    if rate_hz is None:
        return OK, "received", values
    if not rates.min_rate_hz <= rate_hz <= rates.max_rate_hz:
        expected = f"{rates.min_rate_hz:g} to {rates.max_rate_hz:g}"
        return WARN, f"at {rate_hz:.1f} Hz, expected {expected}", values
    return OK, f"received at {rate_hz:.1f} Hz", values
