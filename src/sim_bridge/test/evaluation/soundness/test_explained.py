# SPDX-License-Identifier: Apache-2.0
"""The pictures that explain the check show what the page says of them."""

from pathlib import Path

import pytest

from risk_dqn_planner.decision import Action
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.course import BRAKE
from risk_dqn_planner.safety.joint_check import joint_check
from sim_bridge.evaluation.soundness.reporting.explained import main, side_by_side


def test_all_pictures_are_drawn_and_small_enough_for_the_repository(tmp_path: Path) -> None:
    assert main([str(tmp_path)]) == 0
    pictures = sorted(path.name for path in tmp_path.iterdir())
    assert pictures == ["apart.png", "check.png", "sight.png"]
    assert all(10_000 < path.stat().st_size < 150_000 for path in tmp_path.iterdir())


def test_from_a_metre_before_the_lanes_no_motion_is_safe_and_from_further_back_braking_is() -> None:
    near = joint_check(side_by_side(1.0), SafetyAssumptions())
    assert not near.admissible.any()
    further = joint_check(side_by_side(1.5), SafetyAssumptions())
    assert further.periods[0, Action.STOP] == BRAKE
    assert not further.admissible[0, Action.FAST]


def test_a_call_without_a_folder_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert "error: name the folder" in capsys.readouterr().err
