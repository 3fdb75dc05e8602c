# SPDX-License-Identifier: Apache-2.0
import json
from pathlib import Path
from typing import Any

import pytest

from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.evaluation import campaign, evaluate
from sim_bridge.evaluation.reporting.markdown import entries_told
from sim_bridge.evaluation.soundness.beam import BeamConfig
from sim_bridge.evaluation.soundness.cells import GOAL, GRANTED, VIOLATED, soundness_cells
from sim_bridge.evaluation.soundness.evaluate import Plan
from sim_bridge.evaluation.soundness.reporting.tables import at_a_glance, cells_reached, outcome
from sim_bridge.maps import shipped_map

OPTIONS = [
    "--set", "soundness", "--episodes", "6", "--limit-episodes", "2", "--map", "four_way",
    "--scenarios", "severe_occlusion", "--policies", "fastest_sound,sound_dqn,rule_based",
]  # fmt: skip


def run(folder: Path, *more: str) -> dict[str, Any]:
    assert evaluate.main([*OPTIONS, "--output", str(folder), *more]) == 0
    content: dict[str, Any] = json.loads((folder / "results.json").read_text())
    return content


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run with its page."""
    path = tmp_path_factory.mktemp("soundness")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BeamConfig, "__init__", _narrow)
        run(path, "--report", str(path / "page.md"))
    return path


def _narrow(self: BeamConfig) -> None:
    for name, value in (("width", 8), ("cell_m", 0.5), ("cell_mps", 0.5)):
        object.__setattr__(self, name, value)


def test_lines_hold_limits_and_causes_beside_the_usual_figures(folder: Path) -> None:
    lines = json.loads((folder / "results.json").read_text())["cells"]
    goal = [line for line in lines if line["part"] == "goal"]
    names = ["clairvoyant", "sound_limit", "fastest_sound", "sound_dqn", "rule_based"]
    assert [line["policy"] for line in goal] == names * 2
    for line in goal:
        assert line["episodes"] == (2 if line["policy"] in names[:2] else 6)
        assert line["limits"]["episodes"] == line["timeouts"]["episodes"] == 2
        reached, sound = line["limits"]["clairvoyant"], line["limits"]["sound_limit"]
        assert reached["rate"] >= sound["rate"]
        causes = sum(line["timeouts"][key] for key in ("impossible", "price", "missed"))
        assert causes <= 2
        assert {"success", "mean_speed_mps", "switch_share", "hard_brake_share"} <= line.keys()
    frontier = [line for line in lines if line["part"] == "frontier"]
    assert [line["policy"] for line in frontier].count("fastest_sound") == 2 * 8


@pytest.mark.parametrize("policy", ["fastest_sound", "sound_dqn"])
def test_who_thinks_hidden_vehicles_slow_drives_otherwise(folder: Path, policy: str) -> None:
    lines = json.loads((folder / "results.json").read_text())["cells"]
    speeds = {
        line["mean_speed_mps"]["mean"]
        for line in lines
        if line["part"] == "frontier" and line["policy"] == policy
        if line["hidden_top_speed_mps"] in (0.0, 4.0, 100.0)
    }
    assert len(speeds) >= 3


def test_the_page_shows_every_part_that_was_driven(folder: Path) -> None:
    page = (folder / "page.md").read_text()
    for title in ("At a glance", "Collisions", "What is possible", "With memory", "Accepted risk"):
        assert f"## {title}" in page
    assert (folder / "images" / "soundness" / "accepted_risk.png").stat().st_size > 0


def test_a_second_run_drives_nothing_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("this cell was driven before")

    expected = json.loads((folder / "results.json").read_text())
    monkeypatch.setattr(campaign, "roll_out", refuse)
    monkeypatch.setattr(BeamConfig, "__init__", _narrow)
    assert run(folder) == expected


def test_a_broken_promise_stands_out() -> None:
    shares = {"success": {"rate": 0.5}, "collision": {"rate": 0.5}, "timeout": {"rate": 0.0}}
    line = {**shares, "episodes": 4, "sound": True, "assumptions_hold": True}
    assert outcome(line) == "50.0 / 🔴 **2 collisions** / 0.0"
    assert outcome({**line, "sound": False}) == "50.0 / 50.0 / 0.0"


def test_a_choice_that_leaves_nothing_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = ["--output", str(tmp_path), "--scenarios", "nowhere"]
    assert evaluate.main(["--set", "soundness", *more]) == 2
    assert "no cell of the set is left" in capsys.readouterr().err


def test_a_map_file_has_every_part_and_the_figures_of_the_own_map_it_is(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, town = shipped_map("four_way"), tmp_path / "town.osm"
    town.write_bytes(own.path.read_bytes())
    where = ["--map", str(town), "--route", ",".join(map(str, own.route))]
    where += ["--origin", f"{own.origin.latitude_deg},{own.origin.longitude_deg}"]
    monkeypatch.setattr(BeamConfig, "__init__", _narrow)
    lines = run(tmp_path, *where)["cells"]
    assert {line.pop("map") for line in lines} == {str(town)}
    expected = json.loads((folder / "results.json").read_text())["cells"]
    assert {line.pop("map") for line in expected} == {"four_way"}
    assert lines == expected


def test_where_the_map_begins_in_sight_page_and_results_say_so() -> None:
    told = entries_told({"entries_in_sight_m": {"town.osm": {"7": 42.0, "9": 60.5}}})
    assert "town.osm" in told
    assert "lanes 7 (42 m before its zone), 9 (60.5 m before its zone)" in told
    assert entries_told({"entries_in_sight_m": {}}) == entries_told({}) == ""


def test_a_route_for_several_maps_and_an_unknown_map_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    more = ["--set", "soundness", "--output", str(tmp_path), "--episodes", "1"]
    for chosen in (["--route", "1,2"], ["--origin", "49,8", "--map", "four_way,roundabout"]):
        assert evaluate.main([*more, *chosen]) == 2
        assert "belong to one map" in capsys.readouterr().err
    assert evaluate.main([*more, "--map", "atlantis"]) == 2
    assert "atlantis" in capsys.readouterr().err
    assert evaluate.main([*more, "--map", "town.osm"]) == 2
    assert "its route must be given" in capsys.readouterr().err


def test_policies_that_search_drive_fewer_episodes_but_all_whose_limits_are_searched() -> None:
    cell = soundness_cells()[0]
    plan = Plan(Path("out"), episodes=100_000, search_episodes=2000, limit_episodes=300)
    assert plan.episodes_of("fastest_sound", cell) == 100_000
    assert plan.episodes_of("look_ahead", cell) == 2000
    assert plan.limited == 300
    small = Plan(Path("out"), episodes=50, search_episodes=20, limit_episodes=300)
    assert (small.episodes_of("look_ahead", cell), small.limited) == (20, 20)


def test_who_may_not_collide_can_be_asked_for_more_episodes() -> None:
    plan = Plan(Path("out"), episodes=2000, sound_episodes=100_000, search_episodes=300)
    goal, granted, other = (
        next(each for each in soundness_cells() if each.part == part)
        for part in (GOAL, GRANTED, VIOLATED)
    )
    for policy in ("fastest_sound", "sound_dqn"):
        assert plan.episodes_of(policy, goal) == 100_000
        assert plan.episodes_of(policy, granted) == 100_000
        assert plan.episodes_of(policy, other) == 2000
    for policy in ("tuned+supervisor", "tuned"):
        assert plan.episodes_of(policy, goal) == 2000
    assert plan.episodes_of("look_ahead", goal) == 300
    with pytest.raises(ConfigurationError, match="sound_episodes is 0"):
        Plan(Path("out"), sound_episodes=0)


def test_a_glance_takes_the_mean_of_the_cells_and_all_collisions() -> None:
    share, speed = {"rate": 0.1}, {"mean": 4.0}
    first = {
        "policy": "brave", "episodes": 100, "success": {"rate": 1.0}, "collision": {"rate": 0.0},
        "mean_speed_mps": speed, "switch_share": share, "hard_brake_share": share,
        "switches_per_episode": {"mean": 2.0},
        "actions_per_episode": {"stop": {"mean": 5.0}, "fast": {"mean": 15.0}},
    }  # fmt: skip
    second = {
        **first, "success": {"rate": 0.5}, "collision": {"rate": 0.03},
        "switches_per_episode": {"mean": 1.0}, "actions_per_episode": {"stop": {"mean": 80.0}},
    }  # fmt: skip
    row = at_a_glance([first, {**second, "mean_speed_mps": {"mean": 2.0}}]).splitlines()[-1]
    # 2 + 1 changes in 20 + 80 decisions.
    assert row == "| brave | 2 | 75.0 | 3.00 | 10.0 | 3.0 | 10.0 | 3 |"


def test_cells_are_counted_that_come_near_the_limit_of_their_own() -> None:
    def line(policy: str, scenario: str, success: float, mps: float) -> dict[str, Any]:
        limits = {"sound_limit": {"rate": 0.5}, "success": {"rate": success}}
        return {
            "policy": policy, "map": "four_way", "scenario": scenario, "sensor_forward_m": 0.0,
            "mean_speed_mps": {"mean": mps},
            "limits": {**limits, "mean_speed_mps": {"mean": mps}},
        }  # fmt: skip

    lines = [
        line("sound_limit", "base", 0.5, 4.0), line("brave", "base", 0.49, 3.9),
        line("sound_limit", "fog", 0.5, 2.0), line("brave", "fog", 0.49, 1.8),
        line("sound_limit", "rain", 0.5, 2.0), line("brave", "rain", 0.48, 2.0),
        line("brave", "nobody searched", 1.0, 4.0),
    ]  # fmt: skip
    row = cells_reached(lines, ["brave"]).splitlines()[-1]
    assert row == "| brave | 3 | 2 | 2 | 1 |"
