# SPDX-License-Identifier: Apache-2.0
"""A run is shipped by one command, and its card says where every number comes from."""

import hashlib
import json
from pathlib import Path
from typing import Any

import pytest

from risk_dqn_planner.policies.network import RiskDqn
from risk_dqn_planner.policies.policy_file import PolicyContract, save_policy
from risk_dqn_planner.policies.shipped import shipped_policies
from sim_bridge.learning.presets import PRESETS
from sim_bridge.learning.ship import main

pytestmark = pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")

Line = dict[str, Any]


def a_run(
    folder: Path, reward: str = "risk", preset: str = "tuned", name: str = "", **described: object
) -> str:
    """Write a finished run of an untrained network; return its hash."""
    folder.mkdir()
    config = {"preset": preset, "steps": PRESETS[preset].steps}
    outcome = {
        "run": {
            "config": config,
            "reward": reward,
            "seed": 3,
            "map_name": "four_way",
            "scenario": "base",
        }
        | described,
        "best_steps": 123456,
        "validation": {
            "episodes": 400,
            "success": 0.985,
            "collision": 0.005,
            "timeout": 0.01,
            "mean_speed_mps": 3.21,
        },
    }
    contract = PolicyContract(
        name=name or f"{reward}_{preset}",
        maps=("four_way",),
        training=outcome,
        git_revision="0123abcd",
    )
    sha256 = save_policy(folder / "policy.pt", RiskDqn(), contract)
    (folder / "result.json").write_text(json.dumps({**outcome, "sha256": sha256}))
    return sha256


def a_line(policy_hash: str, seed: int, successes: int, **others: object) -> Line:
    """A line of results.json: of 200 episodes some succeed, one collides."""
    share = {"low": 0.9, "high": 0.99}
    return {
        "policy": "risk_tuned",
        "policy_hash": policy_hash,
        "training_seed": seed,
        "map": "four_way",
        "scenario": "base",
        "traffic": "finite",
        "sensor_range_m": 70.0,
        "episodes": 200,
        "success": {"rate": successes / 200, **share},
        "collision": {"rate": 1 / 200, **share},
        "timeout": {"rate": (199 - successes) / 200, **share},
        "mean_speed_mps": {"mean": 3.14, "low": 3.0, "high": 3.3},
        **others,
    }


def results(path: Path, *lines: Line) -> str:
    path.write_text(json.dumps({"versions": {}, "cells": lines}))
    return str(path)


@pytest.fixture
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)  # there are no results in out/evaluation here
    return tmp_path / "models"


def ship(models: Path, *options: str) -> int:
    return main(["--models", str(models), *options])


def test_a_run_is_shipped_with_its_bytes_its_hash_and_its_card(models: Path) -> None:
    sha256 = a_run(Path("run"))
    assert ship(models, "--run", "run", "--name", "tuned") == 0
    data = (models / "tuned.pt").read_bytes()
    assert data == Path("run/policy.pt").read_bytes()
    assert hashlib.sha256(data).hexdigest() == sha256
    assert (models / "SHA256SUMS").read_text() == f"{sha256}  tuned.pt\n"
    card = (models / "tuned.md").read_text()
    for words in (
        sha256,
        "| best on validation after | 123456 steps |",
        "On the 400 validation episodes that chose it: success 98.5 %",
        "git checkout 0123abcd\n",
        "make train PRESET=tuned REWARD=risk SEED=3\n",
        "out/training/risk_tuned_seed3/policy.pt",
        "Not evaluated yet",
    ):
        assert words in card


def test_a_second_policy_joins_the_first_and_replaces_its_own_former_file(models: Path) -> None:
    old, paper, new = a_run(Path("a")), a_run(Path("b"), preset="paper"), a_run(Path("c"))
    for run, name in (("a", "tuned"), ("b", "risk_aware_paper"), ("c", "tuned")):
        assert ship(models, "--run", run, "--name", name) == 0
    listed = {name: policy.sha256 for name, policy in shipped_policies(models).items()}
    assert old != new
    assert listed == {"risk_aware_paper": paper, "tuned": new}


def test_what_is_not_the_default_stands_in_the_command_that_trains_it_again(models: Path) -> None:
    places, scenario = "four_way,t_junction", "base,rush hour.yaml"
    a_run(Path("run"), name="mine", map_name=places, scenario=scenario)
    assert ship(models, "--run", "run", "--name", "tuned") == 0
    card = (models / "tuned.md").read_text()
    assert f"SEED=3 MAP={places} SCENARIO='{scenario}' NAME=mine\n" in card
    assert "| scenarios | base, rush hour.yaml |" in card


def test_the_card_holds_counts_intervals_and_the_other_seeds(models: Path) -> None:
    sha256 = a_run(Path("run"))
    dense = {"scenario": "dense_traffic"}
    file = results(
        Path("results.json"),
        a_line(sha256, 3, 190),
        a_line("other seed", 4, 150),
        a_line("other policy", 4, 10, policy="rule_based", training_seed=None),
        a_line(sha256, 3, 120, **dense),
        a_line("other seed", 4, 100, **dense),
    )
    assert ship(models, "--run", "run", "--name", "tuned", "--results", file) == 0
    card = (models / "tuned.md").read_text()
    rows = [line for line in card.splitlines() if line.startswith("| four_way |")]
    assert len(rows) == 2
    assert "| finite | base | 70 m | 200 | 190 = 95.0 % [90.0, 99.0] | 1 = 0.5 % [" in rows[0]
    assert rows[0].endswith("| 3.14 [3.00, 3.30] | 4: 75.0 / 0.5 / 24.5 |")
    assert rows[1].endswith("| 4: 50.0 / 0.5 / 49.5 |")
    assert "It can collide: 2 of all 400 episodes" in card
    assert (
        "Least success: 60.0 %, on four_way, dense_traffic with finite traffic, seen to 70 m."
        in card
    )


def test_cards_are_written_anew_from_later_results(models: Path) -> None:
    sha256 = a_run(Path("run"))
    ship(models, "--run", "run", "--name", "tuned")
    file = results(Path("results.json"), a_line(sha256, 3, 180))
    assert ship(models, "--results", file) == 0
    assert "180 = 90.0 %" in (models / "tuned.md").read_text()
    again = results(Path("results.json"), a_line(sha256, 3, 190))
    assert ship(models, "--name", "tuned", "--results", again) == 0
    assert "190 = 95.0 %" in (models / "tuned.md").read_text()


def test_a_card_does_not_lose_its_results_to_those_of_other_policies(
    models: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sha256 = a_run(Path("run"))
    file = results(Path("results.json"), a_line(sha256, 3, 180))
    ship(models, "--run", "run", "--name", "tuned", "--results", file)
    others = results(Path("others.json"), a_line("another", 3, 10))
    assert ship(models, "--results", others) == 2
    assert f"the results have none of tuned ({sha256})" in capsys.readouterr().err
    assert "180 = 90.0 %" in (models / "tuned.md").read_text()


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--run", "run"], "--name is missing, expected one of: risk_aware_paper"),
        (["--run", "run", "--name", "best"], "no policy is shipped as 'best'"),
        (["--run", "run", "--name", "risk_aware_paper"], "stands for the preset 'paper'"),
        (["--run", "unfinished", "--name", "tuned"], "unfinished holds no finished training run"),
        (["--run", "changed", "--name", "tuned"], "expected 00"),
        (["--results", "nowhere.json"], "nowhere.json cannot be read"),
        (["--results", "run/result.json"], "holds no results of `evaluate`"),
        ([], "out/evaluation/results.json cannot be read"),
    ],
)
def test_what_cannot_be_shipped_is_named(
    models: Path, capsys: pytest.CaptureFixture[str], options: list[str], complaint: str
) -> None:
    a_run(Path("run"))
    Path("unfinished").mkdir()
    a_run(Path("changed"))
    result = json.loads(Path("changed/result.json").read_text()) | {"sha256": "00"}
    Path("changed/result.json").write_text(json.dumps(result))
    assert ship(models, *options) == 2
    assert complaint in capsys.readouterr().err
    assert not models.exists()


def test_a_policy_that_training_has_not_written_is_refused(
    models: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("run").mkdir()
    sha256 = save_policy(Path("run/policy.pt"), RiskDqn(), PolicyContract(name="home_made"))
    Path("run/result.json").write_text(json.dumps({"sha256": sha256}))
    assert ship(models, "--run", "run", "--name", "tuned") == 2
    assert "does not tell how it was trained ('run' is missing)" in capsys.readouterr().err
