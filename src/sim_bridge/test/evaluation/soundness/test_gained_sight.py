# SPDX-License-Identifier: Apache-2.0
"""What the memory of seen space gives, as docs/hidden_space.md says it."""

import pytest

from sim_bridge.environment.place import load_place
from sim_bridge.evaluation.soundness.gained_sight import main, mean_sight_m


def test_who_remembers_more_knows_more_to_be_free() -> None:
    place = load_place("four_way")
    sights = [
        mean_sight_m(place, "close_small_obstacle", slowest_mps, 0.5, 32)
        for slowest_mps in (None, 0.0, 2.0)
    ]
    assert sights == sorted(sights)
    assert sights[2] > sights[0] + 5.0


def test_an_argument_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["more"]) == 2
    assert "takes no arguments" in capsys.readouterr().err
