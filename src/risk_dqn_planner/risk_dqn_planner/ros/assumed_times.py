# SPDX-License-Identifier: Apache-2.0
"""What the supervisor takes for granted of the times of situations. Plain Python, without ROS 2."""

from dataclasses import dataclass

from risk_dqn_planner.ros.streams import SECOND_NS
from risk_dqn_planner.safety.assumptions import SafetyAssumptions


@dataclass(frozen=True)
class AssumedTimes:
    """How old situations may be when they are decided on, and how far apart successive ones."""

    delay_s: float
    period_s: float
    period_error_s: float

    @classmethod
    def of(cls, assumptions: SafetyAssumptions) -> "AssumedTimes":
        """Return what these assumptions say."""
        return cls(
            assumptions.actuation_delay_s,
            assumptions.decision_period_s,
            assumptions.period_error_s,
        )

    def objection_to_age(self, age_s: float | None) -> str:
        """Return what an age [s] breaks; nothing if it is within the assumptions, or not known."""
        if age_s is None or age_s <= self.delay_s:
            return ""
        return (
            f"{age_s:.2f} s old, but the supervisor assumes that decisions take effect within "
            f"{self.delay_s:g} s (safety.actuation_delay_s)"
        )

    def objection_to_gap(self, gap_s: float) -> str:
        """Return what the time [s] between two situations that were decided on breaks."""
        # Above the period the parameter says that nothing is assumed.
        assumed = self.period_error_s < self.period_s
        if not assumed or abs(gap_s - self.period_s) <= self.period_error_s + 1e-9:
            return ""
        return (
            f"{gap_s:.3f} s after the one decided on before, but the supervisor assumes "
            f"{self.period_s:g} s but for {self.period_error_s:g} s (safety.period_error_s)"
        )


class Gaps:
    """Tells of situations that came too early or too late after the ones decided on before."""

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._objection = ""

    def note(self, stamp_ns: int | None, assumed: AssumedTimes | None) -> None:
        """Take note of the time of a situation decided on, None for none."""
        last_ns, self._last_ns = self._last_ns, stamp_ns
        if assumed is None or stamp_ns is None or last_ns is None or stamp_ns == last_ns:
            return
        self._objection = (
            assumed.objection_to_gap((stamp_ns - last_ns) / SECOND_NS) or self._objection
        )

    def take(self) -> str:
        """Return the last objection since this was asked before."""
        objection, self._objection = self._objection, ""
        return objection
