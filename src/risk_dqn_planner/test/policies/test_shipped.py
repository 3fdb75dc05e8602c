# SPDX-License-Identifier: Apache-2.0
"""The trained policies that come with the planner are what their list and their cards say."""

import hashlib
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from risk_dqn_planner.errors import PolicyFileError, UnknownPolicyError
from risk_dqn_planner.policies import loading, shipped
from risk_dqn_planner.policies.base import Action, Reason
from risk_dqn_planner.policies.loading import load_policy, policy_names
from risk_dqn_planner.policies.shipped import (
    DEFAULT_POLICY,
    SUMS,
    ShippedPolicy,
    models_folder,
    shipped_policies,
    write_sums,
)
from risk_dqn_planner.situation.situations import Situations
from risk_dqn_planner.situation.warm_up import example_situation

pytestmark = pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")

Make = Callable[..., Situations]

POLICIES = shipped_policies()
every_policy = pytest.mark.parametrize("policy", POLICIES.values(), ids=POLICIES)


def test_the_paper_s_two_networks_and_the_default_are_shipped() -> None:
    assert {"risk_aware_paper", "collision_aware_paper", "tuned", "sound_dqn"} <= POLICIES.keys()
    assert DEFAULT_POLICY in POLICIES
    assert POLICIES.keys() <= set(policy_names())


def test_every_file_in_the_folder_is_listed() -> None:
    assert {path.stem for path in models_folder().glob("*.pt")} == POLICIES.keys()
    assert {path.stem for path in models_folder().glob("*.md")} == POLICIES.keys()


@every_policy
def test_a_file_is_small_and_has_the_listed_hash(policy: ShippedPolicy) -> None:
    data = policy.path.read_bytes()
    assert len(data) < 1_000_000
    assert hashlib.sha256(data).hexdigest() == policy.sha256


@every_policy
def test_a_card_names_its_file_s_hash_and_tells_training_results_and_limits(
    policy: ShippedPolicy,
) -> None:
    card = policy.card.read_text(encoding="utf-8")
    assert card.startswith(f"# {policy.name}\n")
    assert policy.sha256 in card
    assert re.search(r"make train PRESET=\w+ REWARD=\w+ SEED=\d+", card)
    assert re.search(r"\| seed \| \d+ \|", card)
    assert re.search(r"\d+ validation episodes that chose it: success \d+\.\d %", card)
    assert re.search(r"\| \d+ = \d+\.\d % \[\d+\.\d, \d+\.\d\] \|", card), "no share with interval"
    assert "## Known limits" in card


@every_policy
def test_it_is_loaded_by_its_name_and_decides(policy: ShippedPolicy) -> None:
    loaded = load_policy(policy.name)
    assert (loaded.name, loaded.hash) == (policy.name, policy.sha256)
    for restart in (True, False):
        decisions = loaded.decide(example_situation(), np.array([restart]))
        assert np.isfinite(decisions.q_values).all()
        wanted = decisions.action if decisions.proposed is None else decisions.proposed
        assert wanted[0] == decisions.q_values[0].argmax()
        assert (decisions.reason[0] == Reason.LEARNED) == (decisions.action[0] == wanted[0])


@every_policy
def test_it_hurries_over_an_empty_crossing(policy: ShippedPolicy, situation: Make) -> None:
    decisions = load_policy(policy.name).decide(situation(), np.ones(1, dtype=bool))
    assert decisions.action[0] == Action.FAST


@pytest.fixture
def copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the models' folder, in which policies are looked for."""
    folder = tmp_path / "models"
    shutil.copytree(models_folder(), folder)
    monkeypatch.setattr(loading, "shipped_policies", lambda: shipped_policies(folder))
    return folder


def test_a_changed_file_is_refused_with_both_hashes(copied: Path) -> None:
    path = copied / "tuned.pt"
    path.write_bytes(path.read_bytes() + b" ")
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    with pytest.raises(PolicyFileError) as caught:
        load_policy("tuned")
    for words in (str(path), f"has SHA-256 {found}", f"expected {POLICIES['tuned'].sha256}"):
        assert words in str(caught.value)


def test_another_policy_s_file_is_refused(copied: Path) -> None:
    shutil.copy(copied / "collision_aware_paper.pt", copied / "risk_aware_paper.pt")
    with pytest.raises(PolicyFileError, match="expected " + POLICIES["risk_aware_paper"].sha256):
        load_policy("risk_aware_paper")


def test_a_listed_file_that_is_gone_is_named(copied: Path) -> None:
    (copied / "tuned.pt").unlink()
    with pytest.raises(PolicyFileError, match=r"tuned\.pt cannot be read"):
        load_policy("tuned")


def test_an_unlisted_file_is_no_policy(copied: Path) -> None:
    shutil.copy(copied / "tuned.pt", copied / "mine.pt")
    with pytest.raises(UnknownPolicyError, match=r"'mine', .* risk_aware_paper, .* tuned"):
        load_policy("mine")


@pytest.mark.parametrize("line", ["tuned.pt", "0123  tuned.pt", "0" * 64 + "  tuned.md"])
def test_a_line_that_lists_nothing_is_named(tmp_path: Path, line: str) -> None:
    (tmp_path / SUMS).write_text(f"{'1' * 64}  a.pt\n{line}\n")
    with pytest.raises(PolicyFileError, match=f"{SUMS}: '{re.escape(line)}' is not"):
        shipped_policies(tmp_path)


def test_without_its_models_the_planner_says_so_and_the_rule_still_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shipped, "__file__", str(tmp_path / "policies" / "shipped.py"))
    with pytest.raises(PolicyFileError, match=r"trained policies are not installed"):
        load_policy("tuned")
    assert load_policy("rule_based").name == "rule_based"


@pytest.mark.parametrize(
    "installed", ["src/risk_dqn_planner/models", "share/risk_dqn_planner/models"]
)
def test_models_are_found_in_sources_and_where_they_are_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, installed: str
) -> None:
    (tmp_path / installed).mkdir(parents=True)
    (tmp_path / installed / SUMS).write_text("")
    base = "src/risk_dqn_planner" if installed.startswith("src") else "lib/python3/site-packages"
    module = tmp_path / base / "risk_dqn_planner" / "policies" / "shipped.py"
    monkeypatch.setattr(shipped, "__file__", str(module))
    assert models_folder() == tmp_path / installed


def test_the_list_is_what_sha256sum_checks(tmp_path: Path) -> None:
    shutil.copytree(models_folder(), tmp_path / "models")
    write_sums(POLICIES, tmp_path / "models")
    assert (tmp_path / "models" / SUMS).read_text() == (models_folder() / SUMS).read_text()
    command = ["sha256sum", "--check", "--strict", SUMS]
    done = subprocess.run(  # noqa: S603 (fixed words)
        command, cwd=tmp_path / "models", capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_names_are_known_without_torch() -> None:
    code = (
        "import sys; from risk_dqn_planner.policies.loading import policy_names; "
        "policy_names(); sys.exit('torch' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], check=False)  # noqa: S603 (the code above)
    assert run.returncode == 0
