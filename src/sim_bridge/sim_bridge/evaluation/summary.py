# SPDX-License-Identifier: Apache-2.0
"""From episodes to the figures of a cell, each with its 95% interval (docs/results_format.md)."""

from typing import Any

import numpy as np

from risk_dqn_planner.policies.base import Action
from sim_bridge.environment.interface import Outcome
from sim_bridge.evaluation.rollout import Driven
from sim_bridge.evaluation.statistics import Mean, Share, mean_interval, ratio_interval, wilson

Figures = dict[str, Any]
_DIGITS = 6


def summarise(driven: Driven) -> Figures:
    """Return the figures of N episodes, ready for JSON; None where nothing was to be counted.

    mean_speed_mps: distance over time of all episodes together, so that standing counts by how
    long it lasts; episode_speed_mps: mean of the episodes' own mean speeds. crossing_time_s: of
    successful episodes. action_share, switch_share, hard_brake_share: of decision steps; hard
    brakes take more than 1 m/s off. min_time_gap_s: mean of the least gap of each episode that
    had one, `worst` is the 5% quantile of these.
    """
    _, outcome, counted = driven.episodes
    steps = counted.action_counts.sum(axis=1)
    success = outcome == Outcome.SUCCESS
    return {
        "episodes": len(outcome),
        **{o.name.lower(): _share(outcome == o) for o in Outcome if o is not Outcome.RUNNING},
        "mean_speed_mps": _plain(ratio_interval(counted.progress_m, counted.duration_s)),
        "episode_speed_mps": _plain(mean_interval(counted.mean_speed_mps)),
        "crossing_time_s": _plain(mean_interval(counted.duration_s[success])),
        "action_share": {
            action.name.lower(): _rate(counted.action_counts[:, action], steps) for action in Action
        },
        "actions_per_episode": {
            action.name.lower(): _plain(mean_interval(counted.action_counts[:, action]))
            for action in Action
        },
        "switches_per_episode": _plain(mean_interval(counted.action_changes)),
        "switch_share": _rate(counted.action_changes, steps),
        "hard_brake_share": _rate(counted.hard_brakes, steps),
        "min_time_gap_s": _time_gap(counted.least_time_gap_s),
    }


def summarise_first(driven: Driven, count: int) -> Figures:
    """Return what is needed to compare the first episodes one by one with those of others.

    letters: how each of them ended, S, C or T. mean_speed_mps: as in `summarise`.
    """
    _, outcome, counted = driven.episodes
    speed = ratio_interval(counted.progress_m[:count], counted.duration_s[:count])
    letters = "".join(Outcome(o).name[0] for o in outcome[:count])
    return {"letters": letters, "mean_speed_mps": _plain(speed)}


def _share(happened: np.ndarray[Any, np.dtype[np.bool_]]) -> Figures:
    return _plain(wilson(int(happened.sum()), len(happened))) or {}


def _rate(parts: Any, steps: Any) -> Figures | None:  # noqa: ANN401 (arrays)
    ratio = ratio_interval(parts, steps)
    if ratio is None:
        return None
    return _plain(Share(ratio.mean, max(ratio.low, 0.0), min(ratio.high, 1.0)))


def _time_gap(gaps_s: Any) -> Figures | None:  # noqa: ANN401 (arrays)
    known = gaps_s[np.isfinite(gaps_s)]
    figures = _plain(mean_interval(known))
    if figures is None:
        return None
    worst = round(float(np.quantile(known, 0.05)), _DIGITS)
    return {**figures, "worst": worst, "episodes": len(known)}


def _plain(value: Mean | Share | None) -> Figures | None:
    """Return rounded numbers, so that the last bits of sums do not show in files."""
    if value is None:
        return None
    return {key: round(number, _DIGITS) + 0.0 for key, number in value._asdict().items()}
