# SPDX-License-Identifier: Apache-2.0
"""The paper's four figures from our results, the paper's own values in them, as PNG."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes

from sim_bridge.evaluation.cells import BASE, CHALLENGES, RANGES_M, TRAFFIC
from sim_bridge.evaluation.clairvoyant import NAME as CLAIRVOYANT
from sim_bridge.evaluation.reporting.curves import Curve, Curves, band
from sim_bridge.evaluation.reporting.paper_values import (
    ACTION_USAGE,
    CHALLENGING,
    MEAN_SPEED_MPS,
    RULE_BASED,
    paper_role,
)
from sim_bridge.evaluation.reporting.plotting import (
    Bars,
    Values,
    collision_mark,
    colors,
    interval_mark,
    legend,
    limit_mark,
    new_figure,
    save,
)
from sim_bridge.evaluation.reporting.selection import (
    Line,
    actions_normalised,
    cell_of,
    policies,
    reader,
    spread,
)

TRAINING_PNG = "success_during_training.png"
ACTIONS_PNG = "action_usage.png"
CHALLENGES_PNG = "challenging_groups.png"
SPEEDS_PNG = "mean_speed_by_range.png"
_ACTIONS = ("fast", "slow", "stop")
_INTERVAL = "95% intervals of all seeds"
_LIMIT = "clairvoyant: the limit"
# Policies that are there to be compared with, but would only crowd these figures.
_CONSTANT = ("always_fast", "always_slow", "always_stop")


def draw_figures(lines: Sequence[Line], curves: Curves, folder: Path) -> list[Path]:
    """Draw all figures for which there is something to draw; return their files.

    lines: cells of results.json. curves: of the training runs, by policy.
    """
    drawn = [
        _training(curves, folder / TRAINING_PNG),
        _actions(lines, folder / ACTIONS_PNG),
        _challenges(lines, folder / CHALLENGES_PNG),
        _speeds(lines, folder / SPEEDS_PNG),
    ]
    return [path for path in drawn if path is not None]


def _drawn(lines: Sequence[Line]) -> list[str]:
    return [each for each in policies(lines) if each not in (*_CONSTANT, CLAIRVOYANT)]


def _labels(lines: Sequence[Line], drawn: Sequence[str]) -> dict[str, str]:
    """Return what the legend calls the policies: how many seeds, where there are several."""
    labels = {}
    for policy in drawn:
        seeds = {line["policy_hash"] for line in lines if line["policy"] == policy}
        labels[policy] = f"{policy} ({len(seeds)} seeds)" if len(seeds) > 1 else policy
    return labels


def _training(curves: Curves, path: Path) -> Path | None:
    """Success of the running evaluation over training steps, a band over seeds."""
    if not curves:
        return None
    of_paper = {name: each for name, each in curves.items() if paper_role(name) is not None}
    others = {name: each for name, each in curves.items() if name not in of_paper}
    groups = [group for group in (of_paper, others) if group]
    figure, axes = new_figure("Success during training", len(groups), 1.0 + 2.7 * len(groups))
    shades = colors(curves)
    for place, group in zip(axes, groups, strict=True):
        for name, each in group.items():
            _curve(place, name, each, shades[name])
        own, theirs = "our own preset", "the paper's preset (its figure states no numbers)"
        title = theirs if group is of_paper else own
        place.set_title(title, fontsize=11, loc="left")
        place.set(xlabel="training steps [thousands]", ylabel="success rate", ylim=(0.0, 1.02))
        place.set_xlim(left=0.0)
        place.legend(loc="lower right", fontsize=9.5, frameon=False)
    return save(figure, path)


def _curve(place: Axes, name: str, curves: Sequence[Curve], color: str) -> None:
    steps, success = band(curves)
    thousands = steps / 1000.0
    seeds = "1 seed" if len(curves) == 1 else f"mean and range of {len(curves)} seeds"
    place.plot(
        thousands, success.mean(axis=0), color=color, linewidth=2.0, label=f"{name}: {seeds}"
    )
    place.fill_between(thousands, success.min(axis=0), success.max(axis=0), color=color, alpha=0.25)


def _actions(lines: Sequence[Line], path: Path) -> Path | None:
    if not cell_of(lines, RULE_BASED):
        return None
    drawn = _drawn(lines)
    figure, axes = new_figure("Number of actions, relative to the rule-based policy", 2, 6.8)
    for place, traffic in zip(axes, TRAFFIC, strict=True):
        reference = cell_of(lines, RULE_BASED, traffic=traffic)
        bars = Bars(place, _ACTIONS, drawn)
        for policy in drawn:
            bars.add(policy, actions_normalised(cell_of(lines, policy, traffic=traffic), reference))
            # The rule is 1 by definition, in the paper as here.
            if policy != RULE_BASED:
                bars.paper(policy, ACTION_USAGE.get(paper_role(policy) or "", {}))
        _describe(place, traffic, "relative number")
    legend(figure, _labels(lines, drawn), **{_INTERVAL: interval_mark()})
    return save(figure, path)


def _challenges(lines: Sequence[Line], path: Path) -> Path | None:
    if not any(line["scenario"] in CHALLENGES for line in lines):
        return None
    drawn = _drawn(lines)
    figure, axes = new_figure("Success in challenging situations", 2, 7.0)
    for place, traffic in zip(axes, TRAFFIC, strict=True):
        bars = Bars(place, CHALLENGES, drawn)
        for policy in drawn:
            success, collision = (
                _by_scenario(lines, policy, traffic, key) for key in ("success", "collision")
            )
            bars.stack(policy, success, collision)
            bars.add(policy, success)
            bars.paper(policy, CHALLENGING.get(paper_role(policy) or "", {}))
        bars.limit(_by_scenario(lines, CLAIRVOYANT, traffic, "success"))
        _describe(place, traffic, "share of episodes")
        place.set_ylim(0.0, 1.08)
    legend(
        figure,
        _labels(lines, drawn),
        **{
            "collisions; the rest are timeouts": collision_mark(),
            _LIMIT: limit_mark(),
            _INTERVAL: interval_mark(),
        },
    )
    return save(figure, path)


def _by_scenario(lines: Sequence[Line], policy: str, traffic: str, key: str) -> Values:
    return {
        scenario: spread(cell_of(lines, policy, scenario, traffic), reader(key))
        for scenario in CHALLENGES
    }


def _speeds(lines: Sequence[Line], path: Path) -> Path | None:
    if not any(line["sensor_range_m"] in RANGES_M for line in lines):
        return None
    drawn = _drawn(lines)
    figure, axes = new_figure("Mean speed by sensor range", 2, 6.8)
    for place, traffic in zip(axes, TRAFFIC, strict=True):
        bars = Bars(place, [_metres(range_m) for range_m in RANGES_M], drawn)
        for policy in drawn:
            bars.add(policy, _by_range(lines, policy, traffic))
            theirs = MEAN_SPEED_MPS.get(paper_role(policy) or "", {})
            bars.paper(policy, {_metres(range_m): speed for range_m, speed in theirs.items()})
        bars.limit(_by_range(lines, CLAIRVOYANT, traffic))
        _describe(place, traffic, "mean speed [m/s]")
    more = {_LIMIT: limit_mark(), _INTERVAL: interval_mark()}
    legend(figure, _labels(lines, drawn), **more)
    return save(figure, path)


def _by_range(lines: Sequence[Line], policy: str, traffic: str) -> Values:
    return {
        _metres(range_m): spread(
            cell_of(lines, policy, BASE, traffic, range_m), reader("mean_speed_mps")
        )
        for range_m in RANGES_M
    }


def _metres(range_m: float) -> str:
    return f"{range_m:g} m"


def _describe(place: Axes, traffic: str, what: str) -> None:
    place.set_title(f"{traffic} traffic", fontsize=11, loc="left")
    place.set_ylabel(what)
    place.set_ylim(bottom=0.0)
