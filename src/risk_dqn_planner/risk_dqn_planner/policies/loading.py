# SPDX-License-Identifier: Apache-2.0
"""Policies by name: built in, trained, from a policy file, or a user's own factory."""

import importlib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from risk_dqn_planner.errors import PolicyError, UnknownPolicyError
from risk_dqn_planner.policies.base import Action, Policy, StopsAtGoal
from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy, assumptions_of
from risk_dqn_planner.policies.look_ahead import LookAheadPolicy
from risk_dqn_planner.policies.rule_based import RuleBasedConfig, RuleBasedPolicy
from risk_dqn_planner.policies.shipped import ShippedPolicy, shipped_policies
from risk_dqn_planner.policies.trust import ANYTHING, Trust
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.state.encoding import StateConfig

PolicyFactory = Callable[[RuleBasedConfig], Policy]


def _constant(action: Action, config: RuleBasedConfig) -> Policy:  # noqa: ARG001 (a factory)
    return ConstantPolicy(action)


# A further built-in policy is a line here.
BUILT_IN: Mapping[str, PolicyFactory] = {
    "rule_based": RuleBasedPolicy,
    "fastest_sound": FastestSoundPolicy.from_config,
    "look_ahead": LookAheadPolicy.from_config,
    "always_stop": partial(_constant, Action.STOP),
    "always_slow": partial(_constant, Action.SLOW),
    "always_fast": partial(_constant, Action.FAST),
}


def load_policy(
    name: str,
    config: RuleBasedConfig | None = None,
    state: StateConfig | None = None,
    assumptions: SafetyAssumptions | None = None,
    trust: Trust = ANYTHING,
) -> Policy:
    """Return a policy that stops at the goal.

    name: a built-in policy, one of the trained policies that come with the planner, a policy
    file ("path/to/policy.pt"), or "module:factory", where the factory takes a RuleBasedConfig
    and returns a Policy. config: prediction of Algorithm 1, for the rule itself and for the
    risks shown with any decision. state: what a policy file must have been trained on, by
    default StateConfig(). assumptions: what a trained policy rests on that is told which actions
    are sound, by default those that follow from `config`. trust: which policy files may be
    loaded; by default the one that is named, whatever it is.
    Raises UnknownPolicyError for a name that is none of these, PolicyFileError for a file that
    cannot be used, PolicyError for a factory that fails.
    """
    config = config or RuleBasedConfig()
    state = state or StateConfig()
    assumptions = assumptions or assumptions_of(config)
    if name in BUILT_IN:
        policy = BUILT_IN[name](config)
    elif name.endswith(".pt"):
        policy = _from_file(Path(name), config, state, assumptions, trust=trust)
    elif ":" in name:
        policy = _from_factory(name, config)
    else:
        shipped = _shipped(name)
        policy = _from_file(shipped.path, config, state, assumptions, shipped)
    return StopsAtGoal(policy)


def policy_names() -> list[str]:
    """Return the names of all policies that need no file or factory of the user's.

    Raises PolicyFileError if the trained policies are not installed.
    """
    return sorted(BUILT_IN.keys() | shipped_policies().keys())


def _shipped(name: str) -> ShippedPolicy:
    found = shipped_policies().get(name)
    if found is None:
        raise UnknownPolicyError(
            f"there is no policy '{name}', expected one of: {', '.join(policy_names())}; "
            "or a policy file (.pt), or a factory (module:function)"
        )
    return found


def _from_file(
    path: Path,
    config: RuleBasedConfig,
    state: StateConfig,
    assumptions: SafetyAssumptions,
    shipped: ShippedPolicy | None = None,
    trust: Trust = ANYTHING,
) -> Policy:
    # Torch takes seconds to load and is not needed unless a network is asked for.
    from risk_dqn_planner.policies.learned import LearnedPolicy  # noqa: PLC0415
    from risk_dqn_planner.policies.policy_file import (  # noqa: PLC0415
        PolicyContract,
        load_policy_file,
    )
    from risk_dqn_planner.policies.sound_learned import SoundLearnedPolicy  # noqa: PLC0415

    expected = PolicyContract(
        name="", state=state, ego=config.risk.ego, decision_period_s=config.decision_period_s
    )
    sha256 = None if shipped is None else shipped.sha256
    file = load_policy_file(path, expected, sha256, trust)
    name = file.name if shipped is None else shipped.name
    if file.outlook is None:
        return LearnedPolicy(file.module, name, file.sha256, state, config)
    return SoundLearnedPolicy(
        file.module, name, file.sha256, file.outlook, state, config, assumptions
    )


def _from_factory(name: str, config: RuleBasedConfig) -> Policy:
    module_name, _, function_name = name.partition(":")
    try:
        factory = getattr(importlib.import_module(module_name), function_name)
    except (ImportError, AttributeError, ValueError) as error:
        raise UnknownPolicyError(f"policy '{name}' cannot be imported: {error}") from error
    try:
        policy: Policy = factory(config)
    except TypeError as error:
        raise PolicyError(f"policy '{name}' cannot be made: {error}") from error
    for attribute in ("name", "hash", "decide"):
        if not hasattr(policy, attribute):
            raise PolicyError(f"policy '{name}' has no {attribute}, expected a Policy")
    return policy
