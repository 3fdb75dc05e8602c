# SPDX-License-Identifier: Apache-2.0
"""Who takes part in the set `soundness`, each with the assumptions of the cell it is in."""

from risk_dqn_planner.policies.base import Policy, StopsAtGoal
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.policies.supervised import Supervisor
from risk_dqn_planner.policies.supervised_loading import SOUND as BUILT_IN_SOUND
from risk_dqn_planner.policies.supervised_loading import is_sound as chooses_sound
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from sim_bridge.evaluation.rollout import Contestant, PolicyContestant
from sim_bridge.evaluation.soundness.cells import SOUND

_SUPERVISED = "+supervisor"


def is_sound(name: str) -> bool:
    """Tell whether a policy takes sound actions only, as long as its assumptions hold."""
    return name in SOUND or name.endswith(_SUPERVISED)


class Drivers:
    """Makes contestants by their names; files are read once."""

    def __init__(self) -> None:
        self._loaded: dict[str, Policy] = {}

    def of(self, name: str, assumptions: SafetyAssumptions) -> Contestant:
        """Return a contestant; `policy+supervisor` is any policy with the enforcing supervisor.

        Raises:
            PolicyError: there is none of that name.
        """
        if name in BUILT_IN_SOUND:
            return PolicyContestant(StopsAtGoal(BUILT_IN_SOUND[name](assumptions)))
        if name.endswith(_SUPERVISED):
            policy = self._policy(name.removesuffix(_SUPERVISED))
            return PolicyContestant(Supervisor(policy, assumptions=assumptions), name=name)
        if chooses_sound(self._policy(name)):
            return PolicyContestant(load_policy(name, assumptions=assumptions))
        return PolicyContestant(self._policy(name))

    def _policy(self, name: str) -> Policy:
        if name not in self._loaded:
            self._loaded[name] = load_policy(name)
        return self._loaded[name]
