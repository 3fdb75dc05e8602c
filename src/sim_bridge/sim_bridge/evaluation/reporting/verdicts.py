# SPDX-License-Identifier: Apache-2.0
"""A statement held against our results: it holds or not only where intervals do not overlap."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from sim_bridge.evaluation.cells import BASE, TRAFFIC
from sim_bridge.evaluation.reporting.markdown import as_percent
from sim_bridge.evaluation.reporting.paper_values import RULE_BASED, paper_role
from sim_bridge.evaluation.reporting.selection import (
    Line,
    Spread,
    actions_normalised,
    cell_of,
    policies,
    reader,
    spread,
)

# What counts as high success, as nothing, and as equal.
HIGH, NOTHING_LEFT, ALIKE = 0.9, 0.05, 0.15

Form = Callable[[float], str]


class Verdict(NamedTuple):
    """holds: None where the data do not decide. numbers: what it rests on, in words."""

    holds: bool | None
    numbers: str

    def __str__(self) -> str:
        word = {True: "**yes**", False: "**no**", None: "undecided"}[self.holds]
        return f"{word}: {self.numbers}"


class Finding(NamedTuple):
    """A statement of the paper with the verdict for each kind of traffic that was driven."""

    statement: str
    verdicts: dict[str, Verdict]


def times(value: float) -> str:
    """Return a ratio."""
    return f"{value:.2f} x"


def more(ours: Spread | None, other: Spread | None, form: Form) -> Verdict | None:
    """Return whether one number is above another."""
    if ours is None or other is None:
        return None
    holds = True if ours.low > other.high else False if ours.high < other.low else None
    # Numbers that are equal to the last digit are not told apart by an interval.
    if ours.value == other.value:
        holds = False if ours.low == ours.high else None
    return Verdict(holds, f"{form(ours.value)} against {form(other.value)}")


def against(value: Spread | None, limit: float, form: Form) -> Verdict | None:
    """Return whether a number is above a fixed one."""
    return more(value, Spread(limit, limit, limit, 1), form)


class Evidence:
    """The lines of results.json by the paper's roles, in one kind of traffic."""

    def __init__(self, lines: Sequence[Line], traffic: str) -> None:
        self._lines = lines
        self.traffic = traffic
        self._names = {paper_role(policy): policy for policy in policies(lines)}

    def lines(self, role: str, scenario: str = BASE, range_m: float | None = None) -> list[Line]:
        """Return the lines of a role in a cell, one for each seed."""
        name = self._names.get(role)
        return cell_of(self._lines, name, scenario, self.traffic, range_m) if name else []

    def of(
        self, role: str, key: str, scenario: str = BASE, range_m: float | None = None
    ) -> Spread | None:
        """Return a figure of a role in a cell."""
        return spread(self.lines(role, scenario, range_m), reader(key))

    def actions(self, role: str) -> dict[str, Spread]:
        """Return the numbers of actions of a role, relative to the rule-based policy."""
        return actions_normalised(self.lines(role), self.lines(RULE_BASED))


def collected(
    lines: Sequence[Line], statements: dict[str, Callable[[Evidence], Verdict | None]]
) -> list[Finding]:
    """Hold each statement against both kinds of traffic; leave out what nobody has driven."""
    findings = []
    for statement, judge in statements.items():
        judged = {traffic: judge(Evidence(lines, traffic)) for traffic in TRAFFIC}
        verdicts = {traffic: each for traffic, each in judged.items() if each is not None}
        if verdicts:
            findings.append(Finding(statement, verdicts))
    return findings


def all_above(values: Sequence[Spread | None], limit: float) -> Verdict | None:
    """Return whether every one of some numbers is above a fixed one; None unless all are known."""
    verdicts = [against(value, limit, as_percent) for value in values]
    known = [verdict for verdict in verdicts if verdict is not None]
    if not known or len(known) < len(values):
        return None
    holds = [verdict.holds for verdict in known]
    shown = ", ".join(as_percent(value.value) for value in values if value is not None)
    return Verdict(False if False in holds else None if None in holds else True, shown)
