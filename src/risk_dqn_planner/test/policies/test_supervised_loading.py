# SPDX-License-Identifier: Apache-2.0
"""Policy and supervisor rest on the same assumptions."""

from pathlib import Path

import pytest

from risk_dqn_planner.errors import PolicyFileError
from risk_dqn_planner.policies.base import StopsAtGoal
from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy
from risk_dqn_planner.policies.look_ahead import LookAheadPolicy
from risk_dqn_planner.policies.network import OutlookDqn
from risk_dqn_planner.policies.outlook import OutlookConfig
from risk_dqn_planner.policies.policy_file import PolicyContract, save_policy
from risk_dqn_planner.policies.rule_based import RuleBasedPolicy
from risk_dqn_planner.policies.sound_learned import SoundLearnedPolicy
from risk_dqn_planner.policies.supervised import Supervisor, SupervisorMode
from risk_dqn_planner.policies.supervised_loading import is_sound, load_supervised
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.vehicle import EgoLimits, VehicleDimensions

WEAK = SafetyAssumptions(
    speed_error_mps=0.5,
    ego=EgoLimits(braking_mps2=2.5),
    vehicle=VehicleDimensions(length_m=5.0),
)


def test_the_supervisor_s_vehicles_are_the_policy_s() -> None:
    supervisor = load_supervised("rule_based", SupervisorMode.ENFORCE, WEAK)
    assert isinstance(supervisor, Supervisor)
    assert supervisor.assumptions == WEAK
    assert supervisor.name == "rule_based+supervisor"
    assert isinstance(supervisor.policy, StopsAtGoal)
    inner = supervisor.policy.policy
    assert isinstance(inner, RuleBasedPolicy)
    assert (inner.config.risk.ego, inner.config.risk.vehicle) == (WEAK.ego, WEAK.vehicle)


def test_without_a_supervisor_the_policy_is_alone() -> None:
    policy = load_supervised("rule_based", SupervisorMode.OFF)
    assert isinstance(policy, StopsAtGoal)
    assert policy.hash == RuleBasedPolicy().hash


@pytest.mark.parametrize(
    ("name", "kind"), [("fastest_sound", FastestSoundPolicy), ("look_ahead", LookAheadPolicy)]
)
def test_a_policy_that_is_sound_itself_takes_the_assumptions_and_no_supervisor(
    name: str, kind: type[FastestSoundPolicy | LookAheadPolicy]
) -> None:
    policy = load_supervised(name, SupervisorMode.ENFORCE, WEAK)
    assert isinstance(policy, StopsAtGoal)
    assert isinstance(policy.policy, kind)
    assert policy.policy.assumptions == WEAK


def test_a_trained_policy_is_refused_for_an_ego_of_other_target_speeds() -> None:
    faster = SafetyAssumptions(ego=EgoLimits(fast_mps=6.0))
    with pytest.raises(PolicyFileError, match="target_speeds_mps"):
        load_supervised("tuned", SupervisorMode.ENFORCE, faster)


@pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")
def test_a_network_that_is_told_what_is_sound_has_its_supervisor_inside(tmp_path: Path) -> None:
    outlook = OutlookConfig()
    contract = PolicyContract(name="told", outlook=outlook)
    save_policy(tmp_path / "told.pt", OutlookDqn(outlook.size), contract)
    for mode in SupervisorMode:
        policy = load_supervised(str(tmp_path / "told.pt"), mode, WEAK)
        assert isinstance(policy, StopsAtGoal)
        assert isinstance(policy.policy, SoundLearnedPolicy)
        assert policy.policy.assumptions == WEAK


def test_who_chooses_sound_actions_is_known() -> None:
    sound = {"fastest_sound": True, "look_ahead": True, "rule_based": False, "tuned": False}
    found = {name: is_sound(load_supervised(name, SupervisorMode.OFF)) for name in sound}
    assert found == sound
