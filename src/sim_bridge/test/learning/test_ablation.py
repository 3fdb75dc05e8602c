# SPDX-License-Identifier: Apache-2.0
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sim_bridge.environment.episodes import DrivenEpisodes
from sim_bridge.environment.interface import Outcome
from sim_bridge.learning import ablation
from sim_bridge.learning.ablation import COLUMNS, figures_of, main, table_of
from sim_bridge.learning.config import ExplorationConfig
from sim_bridge.learning.presets import preset_named
from sim_bridge.learning.run import Run
from sim_bridge.learning.variants import MEANING, VARIANTS
from sim_bridge.simulation.simulation import EpisodeStatistics

REFERENCE = Run(preset_named("advised"), "progress", 0, "four_way", "base", "enforce")
SUPERVISED = replace(REFERENCE, config=preset_named("supervised"))


def driven(outcomes: list[Outcome], steps: int, changes: int, brakes: int) -> DrivenEpisodes:
    count = len(outcomes)
    return DrivenEpisodes(
        np.arange(count),
        np.array(outcomes),
        EpisodeStatistics(
            duration_s=np.full(count, 10.0),
            progress_m=np.full(count, 20.0),
            mean_speed_mps=np.full(count, 2.0),
            action_counts=np.tile([0, 0, steps], (count, 1)),
            action_changes=np.full(count, changes),
            hard_brakes=np.full(count, brakes),
            least_time_gap_s=np.full(count, np.inf),
        ),
    )


def test_shares_are_of_all_steps_of_all_cells() -> None:
    # 2 x 10 + 1 x 30 = 50 steps with 2 x 2 + 1 = 5 changes and 2 hard brakes.
    cells = [
        driven([Outcome.SUCCESS, Outcome.TIMEOUT], 10, 2, 1),
        driven([Outcome.SUCCESS], 30, 1, 0),
    ]
    figures = figures_of(cells)
    assert figures["success"] == pytest.approx(2 / 3)
    assert figures["timeout"] == pytest.approx(1 / 3)
    assert (figures["switch_share"], figures["hard_brake_share"]) == (0.1, 0.04)


def test_the_table_shows_mean_and_spread_over_the_seeds() -> None:
    one = figures_of([driven([Outcome.SUCCESS], 10, 1, 0)])
    table = table_of({"a": [one, one | {"success": 0.5}]}, COLUMNS)
    assert "| a | 2 | 75.0 [50.0, 100.0] | 0.0 [0.0, 0.0] |" in table


def test_each_variant_differs_from_the_reference_and_from_every_other() -> None:
    runs = [change(REFERENCE) for change in VARIANTS.values()]
    assert runs[0] == REFERENCE
    assert all(a != b for i, a in enumerate(runs) for b in runs[:i])


def test_every_variant_is_explained() -> None:
    assert MEANING.keys() == VARIANTS.keys()


def test_what_is_unknown_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--variants", "luck"]) == 2
    assert "there is no variant 'luck', expected one of: reference" in capsys.readouterr().err
    assert main(["--seeds", "one"]) == 2
    assert "seeds is 'one'" in capsys.readouterr().err


def test_a_comparison_is_written_and_goes_on_where_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    quick = replace(
        preset_named("advised"),
        steps=300,
        environments=4,
        warmup_steps=50,
        evaluation=replace(preset_named("advised").evaluation, validation_episodes=4),
    )
    monkeypatch.setattr(ablation, "preset_named", lambda _: quick)
    options = ["--variants", "reference", "--seeds", "0", "--scenario", "base"]
    page = tmp_path / "page.md"
    options += ["--episodes", "4", "--out", str(tmp_path), "--report", str(page)]
    assert main(options) == 0
    policy = (tmp_path / "reference_seed0" / "policy.pt").read_bytes()
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["reference"][0]["collision"] == 0.0
    assert "| reference | 1 |" in (tmp_path / "table.md").read_text()
    assert "- `reference`: Q-learning with an outlook" in page.read_text()
    assert "| variant | seeds | base % |" in page.read_text()
    assert main(options) == 0
    assert (tmp_path / "reference_seed0" / "policy.pt").read_bytes() == policy


def test_a_repeated_exploration_is_described_and_another_is_not() -> None:
    found = SUPERVISED.description()["config"]["exploration"]
    assert found["repeat"] == 0.8
    plain = replace(SUPERVISED.config, exploration=ExplorationConfig())
    assert "repeat" not in replace(SUPERVISED, config=plain).description()["config"]["exploration"]
