# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import numpy as np
import pytest

from sim_bridge.evaluation.reporting.curves import Curve, band, curves_of
from sim_bridge.evaluation.training_runs import named_runs, training_runs

from .policy_runs import a_run

pytestmark = pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")


def test_only_finished_runs_are_found(tmp_path: Path) -> None:
    a_run(tmp_path / "done", seed=0)
    (tmp_path / "going_on").mkdir()
    (tmp_path / "going_on" / "history.json").write_text("[]")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "result.json").write_text("{")
    assert [run.folder.name for run in training_runs([tmp_path])] == ["done"]


def test_a_run_in_two_folders_is_one_run(tmp_path: Path) -> None:
    for folder in ("own", "published"):
        a_run(tmp_path / folder / "a", seed=0)
    found = training_runs([tmp_path / "own", tmp_path / "published"])
    assert [run.folder for run in found] == [tmp_path / "own" / "a"]


def test_two_trainings_never_share_a_name(tmp_path: Path) -> None:
    a_run(tmp_path / "x", seed=1, name="mine")
    a_run(tmp_path / "y", seed=0, name="mine")
    a_run(tmp_path / "z", seed=2, name="mine", reward="collision")
    found = named_runs(training_runs([tmp_path]))
    assert {name: list(by_seed) for name, by_seed in found.items()} == {"mine": [0, 1], "z": [2]}


def test_a_history_becomes_a_curve(tmp_path: Path) -> None:
    a_run(tmp_path / "a", seed=3, success=[0.0, 0.5, 1.0])
    a_run(tmp_path / "b", seed=4)
    (curve,) = curves_of(named_runs(training_runs([tmp_path])))["tuned"]
    assert curve.seed == 3
    np.testing.assert_array_equal(curve.steps, [0.0, 100.0, 200.0])
    np.testing.assert_array_equal(curve.success, [0.0, 0.5, 1.0])


def test_what_is_said_of_a_curve_is_counted_by_hand() -> None:
    success = np.array([0.0] * 20 + [1.0] * 16 + [0.8, 1.0, 0.8, 1.0])
    curve = Curve(0, 10.0 * np.arange(1, 41), success)
    # The last quarter begins with step 300 of 400: 11 evaluations, two of them 0.8.
    assert curve.last().mean() == pytest.approx((9 + 1.6) / 11)
    # The last half begins with step 200: 20 changes, the first of 1, the last four of 0.2.
    assert curve.unsteadiness() == pytest.approx((1.0 + 4 * 0.2) / 20)
    # Of 40 evaluations three are averaged: the 21st, the first of 1, with a 0 before it.
    assert curve.smoothed()[20] == pytest.approx(2 / 3)
    assert curve.steps_to(0.6) == 210.0
    assert curve.steps_to(0.9) == 220.0
    assert curve.steps_to(1.01) is None


def test_a_band_goes_as_far_as_all_its_runs() -> None:
    short = Curve(0, np.array([0.0, 100.0]), np.array([0.5, 0.5]))
    long = Curve(1, np.array([0.0, 300.0]), np.array([1.0, 1.0]))
    steps, success = band([short, long], points=3)
    np.testing.assert_allclose(steps, [0.0, 50.0, 100.0])
    np.testing.assert_allclose(success, [[0.5] * 3, [1.0] * 3])
