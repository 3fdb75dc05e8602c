# SPDX-License-Identifier: Apache-2.0
import json
from pathlib import Path
from typing import Any

import pytest

from sim_bridge.environment.place import Place, Places, load_place
from sim_bridge.evaluation import campaign, evaluate
from sim_bridge.evaluation.cells import FINITE, RESPAWNING, Cell, paper_cells, what_is_drawn
from sim_bridge.evaluation.reporting.paper_values import paper_role

from .policy_runs import a_run

OPTIONS = ["--episodes", "20", "--policies", "rule_based,always_fast", "--scenarios", "base"]


def run(folder: Path, *more: str) -> dict[str, Any]:
    arguments = [*OPTIONS, "--output", str(folder), "--training", str(folder / "runs"), *more]
    assert evaluate.main(arguments) == 0
    content: dict[str, Any] = json.loads((folder / "results.json").read_text())
    return content


def test_the_paper_s_cells_are_all_there_with_both_kinds_of_traffic() -> None:
    cells = paper_cells()
    assert len(cells) == len(set(cells)) == 16
    for traffic in (RESPAWNING, FINITE):
        ranges = [c.load().sensor.range_m for c in cells if c.traffic == traffic]
        assert ranges == [70.0, 70.0, 70.0, 70.0, 40.0, 40.0, 60.0, 90.0]
    assert all(cell.load().traffic.respawn == (cell.traffic == RESPAWNING) for cell in cells)


def test_short_sensor_range_and_base_at_40_m_are_the_same_work() -> None:
    short, ranged = Cell("short_sensor_range", FINITE), Cell("base", FINITE, 40.0)
    assert what_is_drawn(short.load()) == what_is_drawn(ranged.load())


def test_results_are_written_and_the_same_each_time(tmp_path: Path) -> None:
    first = run(tmp_path / "first")
    assert first == run(tmp_path / "second")
    lines = first["cells"]
    assert [line["policy"] for line in lines] == ["rule_based"] * 2 + ["always_fast"] * 2
    assert [line["traffic"] for line in lines] == [RESPAWNING, FINITE] * 2
    assert all(line["episodes"] == 20 and line["sensor_range_m"] == 70.0 for line in lines)
    assert (tmp_path / "first" / "action_usage.png").stat().st_size > 0


def test_a_second_run_drives_nothing_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = run(tmp_path)

    def refuse(*_: object) -> None:
        raise AssertionError("this cell was driven before")

    monkeypatch.setattr(campaign, "roll_out", refuse)
    assert run(tmp_path) == first


def test_an_interrupted_run_goes_on_with_the_cell_it_was_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = run(tmp_path / "whole")
    drive = campaign.roll_out
    driven = []

    def interrupted(*work: Any) -> Any:  # noqa: ANN401
        if len(driven) == 2:
            raise KeyboardInterrupt
        driven.append(work)
        return drive(*work)

    monkeypatch.setattr(campaign, "roll_out", interrupted)
    folder = tmp_path / "broken"
    assert evaluate.main([*OPTIONS, "--output", str(folder)]) == evaluate.INTERRUPTED
    assert len(list((folder / "cells").glob("*.json"))) == 2
    driven.clear()
    assert run(folder) == expected
    assert len(driven) == 2


def test_the_report_holds_the_numbers(tmp_path: Path) -> None:
    content = run(tmp_path, "--report", str(tmp_path / "docs" / "results.md"))
    text = (tmp_path / "docs" / "results.md").read_text()
    success = 100 * content["cells"][2]["success"]["rate"]
    assert f"| always_fast | {success:.1f} / " in text
    assert f"| always_fast | {success:.1f} [" in text
    assert "](images/results/action_usage.png)" in text
    assert (tmp_path / "docs" / "images" / "results" / "action_usage.png").stat().st_size > 0


@pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")
def test_each_seed_of_a_training_has_its_lines_and_all_are_drawn(tmp_path: Path) -> None:
    for seed in (0, 1):
        folder = tmp_path / "runs" / f"mine_seed{seed}"
        a_run(folder, seed, name="mine", weights=seed, success=[0.0, 0.5, 1.0])
    content = run(tmp_path, "--policies", f"{tmp_path}/runs/*/policy.pt")
    assert [line["policy"] for line in content["cells"]] == ["mine"] * 4
    assert [line["training_seed"] for line in content["cells"]] == [0, 0, 1, 1]
    assert content["versions"]["policies"] == ["mine"]
    assert (tmp_path / "success_during_training.png").stat().st_size > 0


def test_every_line_holds_what_the_format_promises(tmp_path: Path) -> None:
    share, mean = {"rate", "low", "high"}, {"mean", "low", "high"}
    for line in run(tmp_path)["cells"]:
        for name in ("policy", "scenario", "traffic"):
            assert isinstance(line[name], str)
        assert line["training_seed"] is None
        assert line["sensor_range_m"] == 70.0
        assert line["episodes"] == 20
        for name in ("success", "collision", "timeout", "hard_brake_share"):
            assert line[name].keys() == share
        assert {action: value.keys() for action, value in line["action_share"].items()} == (
            dict.fromkeys(("stop", "slow", "fast"), share)
        )
        for name in ("mean_speed_mps", "crossing_time_s", "switches_per_episode"):
            assert line[name].keys() == mean
        assert line["min_time_gap_s"].keys() == mean | {"worst", "episodes"}


def test_lanes_reach_as_far_as_the_sensor_of_a_cell_and_no_other_cell_is_touched() -> None:
    asked: list[float] = []

    def load(reach_m: float) -> Place:
        asked.append(reach_m)
        return load_place("four_way", reach_m=reach_m)

    places = Places(load)
    chosen = {cell: places.of(cell.load()) for cell in paper_cells()}
    assert asked == [70.0, 90.0]
    for cell, place in chosen.items():
        assert (place is places.usual) == (cell.sensor_range_m != 90.0)


def test_the_clairvoyant_is_left_out_where_traffic_reacts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--map", "t_junction", "--policies", "clairvoyant,always_slow"]
    lines = run(tmp_path, *arguments)["cells"]
    assert {line["policy"] for line in lines} == {"always_slow"}
    assert "clairvoyant is left out" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--episodes", "0"], "episodes is 0"),
        (["--policies", "nobody"], "nobody"),
        (["--policies", "nowhere/*.pt"], "nowhere/*.pt"),
        (["--scenarios", "nothing"], "nothing"),
        (["--map", "nowhere"], "nowhere"),
        (["--route", "1,x"], "1,x"),
        (["--projector", "globe"], "unknown map projector 'globe'"),
    ],
)
def test_a_wrong_option_is_named_and_nothing_is_run(
    options: list[str], named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert evaluate.main([*OPTIONS, "--output", str(tmp_path), *options]) == 2
    assert named in capsys.readouterr().err
    assert not (tmp_path / "results.json").exists()


def test_a_folder_that_cannot_be_written_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("in the way")
    assert evaluate.main([*OPTIONS, "--output", str(tmp_path / "file")]) == 2
    assert f"error: cannot write to {tmp_path / 'file'}: File exists" in capsys.readouterr().err


def test_only_what_was_trained_as_in_the_paper_stands_for_it() -> None:
    assert paper_role("risk_paper") == paper_role("risk_aware_paper") == "risk_aware"
    assert paper_role("collision_paper") == "collision_aware"
    assert paper_role("risk_tuned") is None
    assert paper_role("always_fast") is None


@pytest.mark.parametrize(
    ("report", "reason"),
    [("pages", "it is a folder, expected a file"), ("file/page.md", "File exists")],
)
def test_a_report_that_cannot_be_written_is_named_before_anything_is_driven(
    report: str, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "pages").mkdir()
    options = [*OPTIONS, "--output", str(tmp_path), "--report", str(tmp_path / report)]
    assert evaluate.main(options) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: cannot write to ")
    assert reason in error
    assert not (tmp_path / "cells").exists()
