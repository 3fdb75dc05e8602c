# SPDX-License-Identifier: Apache-2.0
"""The paper's four figures on the results page: picture, its values beside ours, what holds."""

from collections.abc import Iterable, Mapping, Sequence

from sim_bridge.evaluation.cells import BASE, CHALLENGES, TRAFFIC
from sim_bridge.evaluation.reporting.curves import Curve, Curves
from sim_bridge.evaluation.reporting.figures import (
    ACTIONS_PNG,
    CHALLENGES_PNG,
    SPEEDS_PNG,
    TRAINING_PNG,
)
from sim_bridge.evaluation.reporting.findings import (
    about_actions,
    about_challenges,
    about_ranges,
    about_training,
)
from sim_bridge.evaluation.reporting.markdown import NOTHING, number, result, table, text_table
from sim_bridge.evaluation.reporting.paper_values import (
    ACTION_USAGE,
    CHALLENGING,
    MEAN_SPEED_MPS,
    RULE_BASED,
    paper_role,
)
from sim_bridge.evaluation.reporting.selection import (
    Line,
    actions_normalised,
    cell_of,
    policies,
    reader,
    spread,
)
from sim_bridge.evaluation.reporting.verdicts import HIGH, Finding

_INTRODUCTION = """\
## Beside the paper

Diamonds in the pictures are the paper's values. Whether a statement of the paper holds here is
decided only where the intervals do not overlap.
"""

_NOTE = """\
The paper draws this figure without numbers. As there, 20 episodes are driven again and again while
a policy is trained; curves are averaged over nine such evaluations.
"""


def sections_beside_paper(
    lines: Sequence[Line], curves: Curves, links: Mapping[str, str]
) -> list[str]:
    """Return the parts of the page. links: from the names of pictures that there are."""
    found = [about_actions(lines), about_challenges(lines), about_ranges(lines)]
    parts = [
        _training(curves, links),
        _section("Action usage", ACTIONS_PNG, links, _actions(lines), found[0]),
        _section("Challenging situations", CHALLENGES_PNG, links, _challenges(lines), found[1]),
        _section("Mean speed by sensor range", SPEEDS_PNG, links, _speeds(lines), found[2]),
    ]
    told = [part for part in parts if part]
    findings = [Finding(text, {"": verdict}) for text, verdict in about_training(curves)]
    findings += [finding for group in found for finding in group]
    return [_INTRODUCTION, *told, _summary(findings)] if told else []


def _summary(findings: Sequence[Finding]) -> str:
    """Return which of the paper's statements are reproduced, from the verdicts above."""
    groups: dict[str, list[str]] = {
        "Reproduced": [],
        "Reproduced with one kind of traffic only": [],
        "Not reproduced": [],
        "Undecided": [],
    }
    for finding in findings:
        verdicts = finding.verdicts
        yes = [traffic for traffic, verdict in verdicts.items() if verdict.holds]
        if len(yes) == len(verdicts):
            groups["Reproduced"].append(finding.statement)
        elif yes:
            said = f"{finding.statement} (with {yes[0]} traffic)"
            groups["Reproduced with one kind of traffic only"].append(said)
        elif any(verdict.holds is False for verdict in verdicts.values()):
            groups["Not reproduced"].append(finding.statement)
        else:
            groups["Undecided"].append(finding.statement)
    parts = ["### What is reproduced, and what is not\n"]
    for title, statements in groups.items():
        if statements:
            listed = "".join(f"- {statement}\n" for statement in statements)
            parts.append(f"**{title}** ({len(statements)} of {len(findings)})\n\n{listed}")
    return "\n".join(parts)


def _picture(links: Mapping[str, str], name: str, title: str) -> str:
    return f"![{title}]({links[name]})\n" if name in links else ""


def _section(
    title: str, picture: str, links: Mapping[str, str], values: str, findings: Sequence[Finding]
) -> str:
    if not values and not findings and picture not in links:
        return ""
    rows = [
        [each.statement, *(str(each.verdicts.get(traffic, NOTHING)) for traffic in TRAFFIC)]
        for each in findings
    ]
    judged = text_table(["the paper says", *TRAFFIC], rows) if rows else ""
    parts = [f"### {title}\n", _picture(links, picture, title), values, judged]
    return "\n".join(part for part in parts if part)


def _training(curves: Curves, links: Mapping[str, str]) -> str:
    if not curves:
        return ""
    rows = []
    for name, each in curves.items():
        reached = [curve.steps_to(HIGH) for curve in each]
        rows.append(
            [
                name,
                ", ".join(str(curve.seed) for curve in each),
                ", ".join(NOTHING if steps is None else f"{steps:.0f}" for steps in reached),
                _listed(100.0 * curve.last().mean() for curve in each),
                _listed(100.0 * Curve.unsteadiness(curve) for curve in each),
            ]
        )
    header = [
        "policy", "seeds", f"steps to {100 * HIGH:.0f}% success", "success in the last quarter, %",
        "change from one evaluation to the next, points",
    ]  # fmt: skip
    judged = [[text, str(verdict)] for text, verdict in about_training(curves)]
    parts = [
        "### Success during training\n",
        _picture(links, TRAINING_PNG, "Success during training"),
        _NOTE,
        table(header, rows),
        text_table(["the paper says", "here"], judged) if judged else "",
    ]
    return "\n".join(part for part in parts if part)


def _listed(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.1f}" for value in values)


def _of_paper(lines: Sequence[Line]) -> list[tuple[str, str]]:
    """Return the policies that stand for the paper's, with their roles."""
    roles = [(policy, paper_role(policy)) for policy in policies(lines)]
    return [(policy, role) for policy, role in roles if role is not None]


def _values(title: str, rows: Sequence[Sequence[str]]) -> str:
    return table([title, "policy", "paper", *TRAFFIC], rows) if rows else ""


def _actions(lines: Sequence[Line]) -> str:
    rows = []
    for action in ("fast", "slow", "stop"):
        for policy, role in _of_paper(lines):
            ours = (
                actions_normalised(
                    cell_of(lines, policy, traffic=traffic),
                    cell_of(lines, RULE_BASED, traffic=traffic),
                ).get(action)
                for traffic in TRAFFIC
            )
            paper = f"{ACTION_USAGE[role][action]:.2f}"
            if role != RULE_BASED:
                rows.append([action, policy, paper, *(number(value) for value in ours)])
    return _values("actions, rule = 1", rows)


def _challenges(lines: Sequence[Line]) -> str:
    rows = []
    for scenario in CHALLENGES:
        for policy, role in _of_paper(lines):
            success = CHALLENGING.get(role, {}).get(scenario)
            ours = [result(cell_of(lines, policy, scenario, each)) for each in TRAFFIC]
            if success is not None and ours != [NOTHING] * len(ours):
                name = scenario.replace("_", " ")
                rows.append([name, policy, f"{100 * success:.0f} / – / –", *ours])
    return _values("success / collision / timeout, %", rows)


def _speeds(lines: Sequence[Line]) -> str:
    rows = []
    of_paper = _of_paper(lines)
    for range_m in sorted({each for speeds in MEAN_SPEED_MPS.values() for each in speeds}):
        for policy, role in of_paper:
            speed = MEAN_SPEED_MPS.get(role, {}).get(range_m)
            cells = [cell_of(lines, policy, BASE, each, range_m) for each in TRAFFIC]
            if speed is not None and any(cells):
                ours = (number(spread(cell, reader("mean_speed_mps"))) for cell in cells)
                rows.append([f"{range_m:g} m", policy, f"{speed:.2f}", *ours])
    return _values("mean speed in m/s", rows)
