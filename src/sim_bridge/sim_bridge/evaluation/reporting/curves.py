# SPDX-License-Identifier: Apache-2.0
"""Success while training, from the histories of runs (paper, figure of the success rate)."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sim_bridge.evaluation.training_runs import TrainingRun

Floats = NDArray[np.float64]

# 20 episodes a point are a noisy measure: shown is the mean over so many evaluations, fewer where
# that would be more than a fifteenth of the run.
_SMOOTHED_OVER = 9
_SMOOTHED_SHARE = 15
_LAST_SHARE = 0.25


class Curve(NamedTuple):
    """One run: success (K,) of the running evaluation after steps (K,); its training seed."""

    seed: int
    steps: Floats
    success: Floats

    def smoothed(self) -> Floats:
        """Return the success (K,) averaged over neighbouring evaluations."""
        window = np.ones(min(_SMOOTHED_OVER, len(self.success) // _SMOOTHED_SHARE | 1))
        counts = np.convolve(np.ones(len(self.success)), window, "same")
        return np.asarray(np.convolve(self.success, window, "same") / counts)

    def last(self) -> Floats:
        """Return the evaluations in the last quarter of the steps."""
        return np.asarray(self.success[self.steps >= (1.0 - _LAST_SHARE) * self.steps[-1]])

    def steps_to(self, success: float) -> float | None:
        """Return after how many steps the smoothed success first reached a value."""
        reached = np.flatnonzero(self.smoothed() >= success)
        return float(self.steps[reached[0]]) if reached.size else None

    def unsteadiness(self) -> float:
        """Return the mean change of success from one evaluation to the next, in the last half."""
        half = self.success[self.steps >= 0.5 * self.steps[-1]]
        return float(np.abs(np.diff(half)).mean()) if half.size > 1 else 0.0


Curves = Mapping[str, list[Curve]]


def curves_of(runs: Mapping[str, Mapping[int, TrainingRun]]) -> dict[str, list[Curve]]:
    """Return the curves of runs by policy, one for each seed; runs without history have none."""
    found = {}
    for name, by_seed in runs.items():
        curves = [_curve(seed, run.history()) for seed, run in by_seed.items()]
        drawn = [curve for curve in curves if curve is not None]
        if drawn:
            found[name] = drawn
    return found


def _curve(seed: int, records: Iterable[Mapping[str, Any]]) -> Curve | None:
    points = [(record["steps"], record["evaluation"]["success"]) for record in records]
    if len(points) < 2:
        return None
    steps, success = np.array(points, dtype=np.float64).T
    return Curve(seed, steps, success)


def band(curves: Iterable[Curve], points: int = 200) -> tuple[Floats, Floats]:
    """Return steps (points,) and the smoothed success (seeds, points), as far as all runs went."""
    given = list(curves)
    first, last = max(each.steps[0] for each in given), min(each.steps[-1] for each in given)
    grid = np.linspace(first, last, points)
    return grid, np.array([np.interp(grid, each.steps, each.smoothed()) for each in given])
