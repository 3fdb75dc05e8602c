# SPDX-License-Identifier: Apache-2.0
"""What was measured, whether it reaches the goals, and the file that says so."""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Goal:
    """A value and what it should be.

    value: None where it was not measured. bound: the least, or with `at_most` the largest, value
    that is good enough. lower_bound: the value is only known to be at least this large, as when
    a peer was stopped before it got there.
    """

    name: str
    value: float | None
    bound: float
    at_most: bool = False
    lower_bound: bool = False

    @property
    def reached(self) -> bool | None:
        """Whether the value is good enough, None where nobody can tell."""
        if self.value is None:
            return None
        if self.at_most:
            return None if self.lower_bound else self.value <= self.bound
        good = self.value >= self.bound
        return good if good or not self.lower_bound else None

    def document(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        kind = "at_most" if self.at_most else "at_least"
        known = {"value_is_lower_bound": True} if self.lower_bound else {}
        return {"value": self.value, **known, "goal": {kind: self.bound}, "reached": self.reached}


@dataclass(frozen=True)
class Section:
    """All that one part of the benchmark found.

    figures: by name, with the unit at its end. ratios: ours against a peer's; goals: our own
    figures. notes: what a reader must know to compare. missing: what was left out, and why.
    """

    figures: Mapping[str, Any] = field(default_factory=dict)
    ratios: tuple[Goal, ...] = ()
    goals: tuple[Goal, ...] = ()
    notes: tuple[str, ...] = ()
    missing: Mapping[str, str] = field(default_factory=dict)


def rounded(value: object) -> object:
    """Return a value with its numbers cut to five digits, which is more than they are worth."""
    if isinstance(value, float):
        return float(f"{value:.5g}")
    if isinstance(value, Mapping):
        return {str(key): rounded(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(inner) for inner in value]
    return value


class Report:
    """Sections in the order of measuring, and the machine they were measured on."""

    def __init__(self, about: Mapping[str, Any]) -> None:
        """Begin a report with what holds for all of it: versions, machine, options."""
        self._about = dict(about)
        self.sections: dict[str, Section] = {}

    def document(self, complete: bool) -> dict[str, Any]:
        """Return all of it as JSON holds it; `complete` is False while sections are to come."""
        sections = self.sections
        return {
            "complete": complete,
            **self._about,
            "figures": rounded({name: section.figures for name, section in sections.items()}),
            "ratios": rounded(
                {goal.name: goal.document() for s in sections.values() for goal in s.ratios}
            ),
            "goals": rounded(
                {goal.name: goal.document() for s in sections.values() for goal in s.goals}
            ),
            "notes": {name: list(section.notes) for name, section in sections.items()},
            "missing": {what: why for s in sections.values() for what, why in s.missing.items()},
        }

    def write(self, path: Path, complete: bool) -> None:
        """Write it whole or not at all."""
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh = path.with_name(f"{path.name}.{os.getpid()}.new")
        text = json.dumps(self.document(complete), indent=1, allow_nan=False)
        fresh.write_text(text + "\n", encoding="utf-8")
        fresh.replace(path)

    def table(self) -> str:
        """Return the ratios and goals as lines to print."""
        sections = self.sections.values()
        goals = [goal for s in sections for goal in (*s.ratios, *s.goals)]
        words = {True: "reached", False: "NOT reached", None: "unknown"}
        lines = [f"{'':<58}{'value':>12}{'goal':>14}"]
        for goal in goals:
            value = "-" if goal.value is None else f"{goal.value:,.4g}"
            if goal.value is not None and goal.value >= 1000:
                value = f"{goal.value:,.0f}"
            shown = f"> {value}" if goal.lower_bound else value
            bound = f"{'<=' if goal.at_most else '>='} {goal.bound:,g}"
            lines.append(f"{goal.name:<58}{shown:>12}{bound:>14}  {words[goal.reached]}")
        for section in sections:
            lines += [f"without {what}: {why}" for what, why in section.missing.items()]
        return "\n".join(lines)
