# SPDX-License-Identifier: Apache-2.0
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from risk_dqn_planner.errors import PolicyError, PolicyFileError, UnknownPolicyError
from risk_dqn_planner.policies.base import Action, Policy, Reason
from risk_dqn_planner.policies.loading import BUILT_IN, load_policy
from risk_dqn_planner.policies.rule_based import RuleBasedConfig, RuleBasedPolicy
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.situation.situations import Situations
from risk_dqn_planner.state.encoding import StateConfig
from risk_dqn_planner.vehicle import EgoLimits

Make = Callable[..., Situations]


@pytest.mark.parametrize("name", sorted(BUILT_IN))
def test_built_in_policies_go_by_their_name_and_stop_at_the_goal(
    situation: Make, name: str
) -> None:
    policy = load_policy(name)
    assert policy.name == name
    decisions = policy.decide(situation(goal_m=-1.0), np.ones(1, dtype=bool))
    assert decisions.action[0] == Action.STOP
    assert decisions.reason[0] == Reason.GOAL_REACHED


def test_the_configuration_reaches_the_rule() -> None:
    config = RuleBasedConfig(risk=RiskConfig(desired_gap_s=2.0))
    assert load_policy("rule_based", config).hash == RuleBasedPolicy(config).hash


def test_an_unknown_name_is_answered_with_the_known_ones() -> None:
    with pytest.raises(UnknownPolicyError, match=r"'rule', .* always_fast, .* rule_based") as error:
        load_policy("rule")
    assert "(.pt)" in str(error.value)


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A user's module with factories of policies."""
    text = """
from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.base import Action

def slow(config):
    return ConstantPolicy(Action.SLOW)

def takes_nothing():
    return ConstantPolicy(Action.SLOW)

def number(config):
    return 3
"""
    (tmp_path / "users_policies.py").write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    return "users_policies"


def test_a_users_factory_makes_a_policy(module: str) -> None:
    policy: Policy = load_policy(f"{module}:slow")
    assert policy.name == "always_slow"


@pytest.mark.parametrize("name", ["nowhere_at_all:make", ":make", "json:make"])
def test_a_factory_that_cannot_be_imported_is_unknown(name: str) -> None:
    with pytest.raises(UnknownPolicyError, match=name):
        load_policy(name)


@pytest.mark.parametrize(
    ("function", "words"), [("takes_nothing", "cannot be made"), ("number", "has no name")]
)
def test_a_factory_that_makes_no_policy_is_refused(module: str, function: str, words: str) -> None:
    with pytest.raises(PolicyError, match=words):
        load_policy(f"{module}:{function}")


@pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")
def test_a_policy_file_is_loaded_with_its_contract(tmp_path: Path, situation: Make) -> None:
    from risk_dqn_planner.policies.network import RiskDqn  # noqa: PLC0415 (needs torch)
    from risk_dqn_planner.policies.policy_file import (  # noqa: PLC0415
        PolicyContract,
        save_policy,
    )

    path = tmp_path / "policy.pt"
    sha256 = save_policy(path, RiskDqn(), PolicyContract(name="untrained"))
    policy = load_policy(str(path))
    assert (policy.name, policy.hash) == ("untrained", sha256)
    decisions = policy.decide(situation(), np.ones(1, dtype=bool))
    assert decisions.reason[0] == Reason.LEARNED
    with pytest.raises(PolicyFileError, match=r"normalisation\.stacked"):
        load_policy(str(path), state=StateConfig(stacked=True))
    with pytest.raises(PolicyFileError, match=r"decision_period_s is 0\.5"):
        load_policy(str(path), RuleBasedConfig(decision_period_s=0.25))
    with pytest.raises(PolicyFileError, match="target_speeds_mps"):
        load_policy(str(path), RuleBasedConfig(risk=RiskConfig(ego=EgoLimits(fast_mps=6.0))))


def test_a_missing_policy_file_is_refused() -> None:
    with pytest.raises(PolicyFileError, match=r"nowhere\.pt cannot be read"):
        load_policy("nowhere.pt")


def test_the_rule_needs_no_torch() -> None:
    code = (
        "import sys; from risk_dqn_planner.policies.loading import load_policy; "
        "load_policy('rule_based'); sys.exit('torch' in sys.modules)"
    )
    run = subprocess.run([sys.executable, "-c", code], check=False)  # noqa: S603 (the code above)
    assert run.returncode == 0
