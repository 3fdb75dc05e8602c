# SPDX-License-Identifier: Apache-2.0
"""The pictures of docs/safety.md, drawn from what the check itself computes.

python -m sim_bridge.evaluation.soundness.reporting.explained docs/images/safety
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from risk_dqn_planner.decision import Action
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.course import BRAKE, GO, Motion, begin_course, way_at, with_manoeuvre
from risk_dqn_planner.safety.joint_check import NO_MANOEUVRE, joint_check, target_of
from risk_dqn_planner.safety.known import at_first_sight
from risk_dqn_planner.safety.others import earliest_arrivals
from risk_dqn_planner.situation.situations import Floats, Situations, empty_situations
from sim_bridge.evaluation.reporting.plotting import WIDTH_IN, save

APART_PNG, SEEN_PNG, SIGHT_PNG = "apart.png", "check.png", "sight.png"
_ASSUMPTIONS = SafetyAssumptions()
_TAKEN, _FREE, _EGO, _BAD = "#CC79A7", "#E8E8E8", "#0072B2", "#D55E00"
_ZONE_M = 6.0
_LATEST_S = 5.0


class _Lane(NamedTuple):
    """A crossing lane: where its zone begins, who comes (infinitely far: nobody), what is seen."""

    starts_m: float
    others_m: float
    mps: float
    hidden_m: float = 70.0


def _situation(lanes: Sequence[_Lane], ego_mps: float) -> Situations:
    s = empty_situations(1, len(lanes), len(lanes))
    s.ego_speed_mps[0], s.goal_distance_m[0] = ego_mps, 30.0
    for k, lane in enumerate(lanes):
        s.lane_mask[0, k], s.lane_id[0, k] = True, k + 1
        s.lane_ego_distance_m[0, k] = lane.starts_m + 0.5 * _ZONE_M
        s.lane_ego_zone_m[0, k] = s.lane_zone_m[0, k] = _ZONE_M
        s.lane_hidden_distance_m[0, k], s.lane_speed_limit_mps[0, k] = lane.hidden_m, 7.0
        s.vehicle_mask[0, k] = np.isfinite(lane.others_m)
        s.vehicle_id[0, k], s.vehicle_lane[0, k] = k + 1, k
        s.vehicle_distance_m[0, k], s.vehicle_speed_mps[0, k] = lane.others_m, lane.mps
    return s


def _course(ego_mps: float, action: Action, periods: int) -> Motion:
    p = _ASSUMPTIONS.numbers()
    course = begin_course(ego_mps, 0.0, target_of(int(action), p), p)
    motion: Motion = with_manoeuvre(course, periods, p).slowest
    return motion


def _arrivals(s: Situations) -> Floats:
    lanes = s.lane_mask.shape[1]
    arrival_s, who = np.empty(lanes), np.empty(lanes, dtype=np.int64)
    p = _ASSUMPTIONS.numbers()
    earliest_arrivals(s, 0, at_first_sight(s, p), p, arrival_s, who)
    return arrival_s


def _zones(axes: Axes, s: Situations) -> None:
    """Show each lane's zone over time: free until anyone may be there, then taken for ever."""
    for lane, arrival_s in enumerate(_arrivals(s)):
        low_m = s.lane_ego_distance_m[0, lane] - 0.5 * _ZONE_M
        free_s = min(float(arrival_s), _LATEST_S)
        axes.broken_barh([(0.0, free_s)], (low_m, _ZONE_M), color=_FREE, alpha=0.7, zorder=0)
        axes.broken_barh(
            [(free_s, _LATEST_S - free_s)], (low_m, _ZONE_M), color=_TAKEN, alpha=0.35, zorder=1
        )
        axes.axhline(low_m, color="#999999", linewidth=0.8)
        axes.axhline(low_m + _ZONE_M, color="#999999", linewidth=0.8)
        axes.annotate(
            f"zone of lane {lane + 1}", (_LATEST_S, low_m + 0.25), (-4, 0),
            textcoords="offset points", ha="right", fontsize=8,
        )  # fmt: skip


def _drive(axes: Axes, course: Motion, label: str, color: str, style: str = "-") -> None:
    time_s = np.linspace(0.0, _LATEST_S, 200)
    way_m = [way_at(course, float(t)) for t in time_s]
    axes.plot(time_s, way_m, color=color, linestyle=style, linewidth=2.2, label=label)


def _finish(axes: Axes, title: str, high_m: float = 13.0) -> None:
    axes.set(xlim=(0.0, _LATEST_S), ylim=(-0.3, high_m), xlabel="time [s]", ylabel="ego's way [m]")
    axes.set_title(title, fontsize=10, loc="left")
    axes.legend(fontsize=8, loc="upper left", frameon=False)
    axes.spines[["top", "right"]].set_visible(False)


def side_by_side(ahead_m: float) -> Situations:
    """Return two lanes side by side: on the first one somebody comes, in the second one stands."""
    return _situation([_Lane(ahead_m, 28.75, 4.0), _Lane(ahead_m + 3.5, 0.0, 0.0)], 3.0)


def draw_apart(folder: Path) -> Path:
    """Draw why conditions for each vehicle apart fail, and from where the check would have held."""
    figure = Figure(figsize=(WIDTH_IN, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, ahead_m, title in (
        (left, 1.0, "1 m before lane 1: each condition holds, for another motion"),
        (right, 1.5, "0.5 m earlier: stopping is safe, and so the check stops"),
    ):
        s = side_by_side(ahead_m)
        _zones(axes, s)
        stops = joint_check(s, _ASSUMPTIONS).periods[0, Action.STOP] == BRAKE
        _drive(axes, _course(3.0, Action.FAST, GO), "leave lane 1 in time", _BAD, "--")
        _drive(
            axes, _course(3.0, Action.STOP, BRAKE), "stop before lane 2", _EGO if stops else _BAD
        )
        _finish(axes, title)
    return save(figure, folder / APART_PNG)


def draw_check(folder: Path) -> Path:
    """Draw what the check sees of one situation, and what it says of the three actions."""
    s = _situation([_Lane(5.0, np.inf, 0.0, 40.0), _Lane(8.5, 22.0, 6.0)], 4.0)
    check = joint_check(s, _ASSUMPTIONS)
    figure = Figure(figsize=(WIDTH_IN, 3.6), layout="constrained")
    for axes, action in zip(figure.subplots(1, 3, sharey=True), Action, strict=True):
        _zones(axes, s)
        periods = int(check.periods[0, action])
        sound = periods != NO_MANOEUVRE
        _drive(axes, _course(4.0, action, BRAKE), "then brake", _EGO if periods == BRAKE else _BAD,
               "-" if periods == BRAKE else "--")  # fmt: skip
        _drive(axes, _course(4.0, action, GO), "then go", _EGO if periods == GO else _BAD,
               "-" if periods == GO else "--")  # fmt: skip
        axes.axvline(_ASSUMPTIONS.decision_period_s, color="black", linewidth=0.8, linestyle=":")
        _finish(axes, f"{action.name}: {'admissible' if sound else 'not admissible'}", 15.0)
    return save(figure, folder / SEEN_PNG)


def draw_sight(folder: Path) -> Path:
    """Draw how far an ego must see to start from rest, and how far a corner lets it see."""
    figure = Figure(figsize=(WIDTH_IN, 3.2), layout="constrained")
    axes = figure.subplots()
    ahead_m = np.linspace(0.0, 2.5, 126)
    p = _ASSUMPTIONS.numbers()
    for corner_m, beside_m, style in ((2.0, 2.4, ":"), (2.3, 2.4, "--"), (2.6, 2.4, "-")):
        x = ahead_m + 3.0 + 3.5
        seen_m = beside_m * x / np.maximum(ahead_m + 3.0 - corner_m, 1e-9)
        label = f"seen past a corner {corner_m:g} m before lane 1"
        axes.plot(ahead_m, seen_m, color=_EGO, linestyle=style, linewidth=2.0, label=label)
    needed_m = [_needed_m(float(ahead)) for ahead in ahead_m]
    axes.plot(ahead_m, needed_m, color=_BAD, linewidth=2.2, label="needed to start from rest")
    axes.axvspan(0.0, p.zone_margin_m, color=_FREE)
    axes.set(xlim=(2.5, 0.0), ylim=(0.0, 70.0), xlabel="ego's centre before the first zone [m]",
             ylabel="along lane 2 [m]")  # fmt: skip
    axes.legend(fontsize=8, loc="upper left", frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    return save(figure, folder / SIGHT_PNG)


def _needed_m(ahead_m: float) -> float:
    """Return how far lane 2 must be seen by an ego at rest before two lanes, by bisection."""
    low_m, high_m = 3.0, 120.0
    while high_m - low_m > 0.05:
        middle_m = 0.5 * (low_m + high_m)
        lanes = [_Lane(ahead_m, np.inf, 0.0), _Lane(ahead_m + 3.5, np.inf, 0.0, middle_m)]
        if _leaves_in_time(_situation(lanes, 0.0)):
            high_m = middle_m
        else:
            low_m = middle_m
    return high_m


def _leaves_in_time(s: Situations) -> bool:
    """Tell whether an ego at rest that goes leaves all zones before anyone may arrive."""
    p = _ASSUMPTIONS.numbers()
    course = _course(0.0, Action.FAST, GO)
    way_m = [way_at(course, max(float(t) - p.safe_gap_s, 0.0)) for t in _arrivals(s)]
    return bool(np.all(way_m >= s.lane_ego_distance_m[0] + 0.5 * _ZONE_M))


def main(argv: Sequence[str] | None = None) -> int:
    """Draw all pictures into the folder that the command line names."""
    arguments: Any = sys.argv[1:] if argv is None else argv
    if len(arguments) != 1:
        print("error: name the folder for the pictures", file=sys.stderr)
        return 2
    for draw in (draw_apart, draw_check, draw_sight):
        print(draw(Path(arguments[0])))
    return 0


if __name__ == "__main__":
    sys.exit(main())
