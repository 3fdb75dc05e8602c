# SPDX-License-Identifier: Apache-2.0
"""How long a training takes to given shares of success on the fixed validation episodes."""

from dataclasses import dataclass, field
from typing import Any

LEVELS = (0.8, 0.9, 0.95, 0.99)
EPISODES = 500


@dataclass
class Reached:
    """When a training first reached each level, and how far it got.

    first: (processor time [s], time of day [s], environment steps) by level. best: highest
    success so far. cpu_s: how long it was given.
    """

    first: dict[float, tuple[float, float, int]] = field(default_factory=dict)
    best: float = 0.0
    cpu_s: float = 0.0

    def look(self, success: float, cpu_s: float, wall_s: float, steps: int) -> None:
        """Take note of a validation."""
        self.best = max(self.best, success)
        self.cpu_s = cpu_s
        for level in LEVELS:
            if success >= level:
                self.first.setdefault(level, (cpu_s, wall_s, steps))

    @property
    def done(self) -> bool:
        """Whether nothing is left to reach."""
        return LEVELS[-1] in self.first

    def seconds_to(self, level: float) -> float | None:
        """Return the processor time to a level, None where it was not reached."""
        return self.first[level][0] if level in self.first else None

    def document(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        levels = {
            f"success_{level:.0%}": dict(
                zip(("cpu_s", "wall_s", "environment_steps"), self.first[level], strict=True)
            )
            if level in self.first
            else None
            for level in LEVELS
        }
        return {**levels, "best_success": self.best, "given_cpu_s": self.cpu_s}
