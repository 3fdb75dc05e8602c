# SPDX-License-Identifier: Apache-2.0
"""Policies together with their supervisor, all from one set of assumptions."""

from collections.abc import Callable, Mapping

from risk_dqn_planner.policies.base import Policy, StopsAtGoal
from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.policies.look_ahead import LookAheadPolicy
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.policies.supervised import Supervisor, SupervisorMode
from risk_dqn_planner.policies.trust import ANYTHING, Trust
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions

# They choose among sound actions themselves: a supervisor around them would never object.
SOUND: Mapping[str, Callable[[SafetyAssumptions], Policy]] = {
    "fastest_sound": FastestSoundPolicy,
    "look_ahead": LookAheadPolicy,
}


def is_sound(policy: object) -> bool:
    """Tell whether a policy chooses among sound actions itself, be it inside of StopsAtGoal."""
    inside = policy.policy if isinstance(policy, StopsAtGoal) else policy
    return bool(getattr(inside, "chooses_sound", False))


def config_of(assumptions: SafetyAssumptions) -> RuleBasedConfig:
    """Return the default prediction with the vehicles of the assumptions.

    So the limits of ego and traffic have one source. The period of the prediction stays the one
    that policies are trained for.
    """
    risk = RiskConfig(ego=assumptions.ego, traffic=assumptions.traffic, vehicle=assumptions.vehicle)
    return RuleBasedConfig(risk=risk)


def load_supervised(
    name: str,
    mode: SupervisorMode,
    assumptions: SafetyAssumptions | None = None,
    trust: Trust = ANYTHING,
) -> Policy:
    """Return a policy as `load_policy` does, with a supervisor around it unless that is off.

    assumptions: what the supervisor's checks rest on; their vehicles are the policy's as well.
    Policies that are sound themselves rest on them and get no supervisor. trust: as in
    `load_policy`.

    Raises:
        PolicyError: as `load_policy`; also for a trained policy whose target speeds are others.
    """
    assumptions = assumptions or SafetyAssumptions()
    if name in SOUND:
        return StopsAtGoal(SOUND[name](assumptions))
    policy = load_policy(name, config_of(assumptions), assumptions=assumptions, trust=trust)
    if mode is SupervisorMode.OFF or is_sound(policy):
        return policy
    return Supervisor(policy, mode, assumptions)
