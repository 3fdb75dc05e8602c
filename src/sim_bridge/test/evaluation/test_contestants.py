# SPDX-License-Identifier: Apache-2.0
import shutil
from pathlib import Path

import pytest

from risk_dqn_planner.errors import ConfigurationError, PolicyError
from risk_dqn_planner.policies import shipped
from sim_bridge.evaluation.contestants import DEFAULT_POLICIES, contestants, named_policies

from .policy_runs import a_run

pytestmark = pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")


@pytest.fixture(autouse=True)
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One policy is shipped: seed 0 of a training called `tuned`."""
    folder = tmp_path / "models"
    sha256 = a_run(tmp_path / "first", seed=0)
    folder.mkdir()
    shutil.copy(tmp_path / "first" / "policy.pt", folder / "tuned.pt")
    (folder / shipped.SUMS).write_text(f"{sha256}  tuned.pt\n")
    monkeypatch.setattr(shipped, "models_folder", lambda: folder)
    return folder


def seeds_of(names: list[str], *folders: Path) -> list[tuple[str, int | None]]:
    return [(each.name, each.training_seed) for each in contestants(names, folders)]


def test_the_papers_policies_and_ours_take_part_by_default() -> None:
    learned = ["risk_aware_paper", "collision_aware_paper", "tuned", "sound_dqn"]
    assert list(DEFAULT_POLICIES) == ["rule_based", "always_fast", *learned, "clairvoyant"]


def test_without_training_runs_the_shipped_seed_stands_alone(tmp_path: Path) -> None:
    assert seeds_of(["tuned"], tmp_path / "nowhere") == [("tuned", 0)]


def test_further_seeds_of_the_same_training_join_under_the_shipped_name(tmp_path: Path) -> None:
    runs = tmp_path / "training"
    a_run(runs / "b", seed=2, weights=2, name="risk_tuned")
    a_run(runs / "a", seed=1, weights=1)
    assert seeds_of(["tuned"], runs) == [("tuned", 0), ("tuned", 1), ("tuned", 2)]


def test_another_training_is_no_further_seed_whatever_its_name(tmp_path: Path) -> None:
    a_run(tmp_path / "training" / "a", seed=1, weights=1, reward="collision")
    assert seeds_of(["tuned"], tmp_path / "training") == [("tuned", 0)]


def test_the_shipped_seed_is_never_counted_twice(tmp_path: Path, models: Path) -> None:
    runs = tmp_path / "training"
    a_run(runs / "same", seed=0)
    assert seeds_of(["tuned"], runs) == [("tuned", 0)]
    # Trained anew elsewhere its hash may differ: it is the same seed all the same.
    a_run(tmp_path / "anew" / "a", seed=0, weights=5)
    (found,) = contestants(["tuned"], [tmp_path / "anew"])
    assert found.hash == shipped.shipped_policies(models)["tuned"].sha256


def test_a_policy_that_is_named_twice_takes_part_once(models: Path) -> None:
    path = str(models / "tuned.pt")
    assert seeds_of(["tuned", path, "tuned", "rule_based", "rule_based"]) == [
        ("tuned", 0),
        ("rule_based", None),
    ]


def test_the_seed_of_a_file_comes_from_its_contract(tmp_path: Path) -> None:
    a_run(tmp_path / "mine", seed=7, name="mine")
    assert seeds_of([str(tmp_path / "mine" / "policy.pt")]) == [("mine", 7)]


def test_two_trainings_of_one_name_are_refused(tmp_path: Path) -> None:
    a_run(tmp_path / "a", seed=1, name="mine")
    a_run(tmp_path / "b", seed=2, name="mine", reward="collision")
    with pytest.raises(ConfigurationError, match="two policies are called mine"):
        contestants(named_policies(f"{tmp_path}/?/*.pt"))


def test_an_unknown_policy_is_named() -> None:
    with pytest.raises(PolicyError, match="'nobody'"):
        contestants(["nobody"])


def test_a_pattern_without_a_file_is_named() -> None:
    with pytest.raises(ConfigurationError, match=r"nowhere/\*\.pt"):
        named_policies("rule_based,nowhere/*.pt")
