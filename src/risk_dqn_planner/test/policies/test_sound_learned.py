# SPDX-License-Identifier: Apache-2.0
"""A network among sound actions: never another one, and it says where it wanted one."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from risk_dqn_planner.decision import explain
from risk_dqn_planner.errors import PolicyError
from risk_dqn_planner.policies.base import Action, Reason, Supervision
from risk_dqn_planner.policies.network import OutlookDqn
from risk_dqn_planner.policies.outlook import OutlookConfig
from risk_dqn_planner.policies.sound_learned import SWITCHING_VALUE, SoundLearnedPolicy
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
AT_THE_ZONE: dict[str, Any] = {"id": 3, "ego_m": 3.15}
COMING: dict[str, Any] = {"id": 8, "lane": 3, "m": 20.0, "mps": 7.0}
NEW = np.array([True])


class Wants(torch.nn.Module):
    """The same values whatever it is told."""

    def __init__(self, *values: float) -> None:
        super().__init__()
        self.values = torch.tensor(values)

    def forward(self, state: torch.Tensor, outlook: torch.Tensor) -> torch.Tensor:
        assert state.shape[1:] == (5, 3, 8)
        assert outlook.shape[1:] == (OutlookConfig().size,)
        return self.values.expand(len(state), len(self.values))


def policy(*values: float) -> SoundLearnedPolicy:
    return SoundLearnedPolicy(Wants(*values), "wants", "abc")


def test_a_sound_action_of_the_highest_value_is_taken(situation: Make) -> None:
    decisions = policy(0.1, 0.3, 0.2).decide(situation([AT_THE_ZONE]), NEW)
    assert decisions.action[0] == Action.SLOW
    assert decisions.reason[0] == Reason.LEARNED
    assert decisions.supervision is not None
    assert decisions.supervision[0] == Supervision.AGREED


def test_where_that_is_not_sound_the_best_sound_one_stands_in_and_it_says_why(
    situation: Make,
) -> None:
    s, wants = situation([AT_THE_ZONE], [COMING]), policy(0.1, 0.2, 0.3)
    decisions = wants.decide(s, NEW)
    assert decisions.action[0] == Action.STOP
    decision = explain(decisions, s, 0, wants)
    assert decision.supervision is Supervision.OVERRULED
    assert decision.proposed is Action.FAST
    assert decision.reason is Reason.VEHICLE
    assert decision.critical_vehicle_id == 8
    # 17 / 7 s less 2.8636 + 0.1 s, see test_joint_check.
    assert decision.explanation.lacking_s == pytest.approx(0.535, abs=1e-3)


@pytest.mark.parametrize(
    ("lead", "expected"),
    [(SWITCHING_VALUE - 0.01, Action.SLOW), (SWITCHING_VALUE + 0.01, Action.FAST)],
)
def test_it_changes_only_for_what_is_worth_a_change(
    situation: Make, lead: float, expected: Action
) -> None:
    s, wants = situation([AT_THE_ZONE]), Wants(-1.0, 0.5, 0.0)
    driver = SoundLearnedPolicy(wants, "wants", "abc")
    assert driver.decide(s, NEW).action[0] == Action.SLOW
    wants.values[Action.FAST] = 0.5 + lead
    decisions = driver.decide(s, ~NEW)
    assert decisions.action[0] == expected
    assert decisions.q_values[0].argmax() == expected


def test_it_never_takes_what_is_not_sound(random_situations: Make) -> None:
    torch.manual_seed(0)
    sound = SoundLearnedPolicy(OutlookDqn(OutlookConfig().size), "random", "")
    guard, restart = Guard(), np.ones(300, dtype=np.bool_)
    overruled = 0
    for seed in range(4):
        s = random_situations(seed, 300)
        decisions, check = sound.decide(s, restart), guard.look(s, restart)
        assert guard.sound(check)[np.arange(300), decisions.action].all()
        guard.decided(check, decisions.action)
        assert decisions.proposed is not None
        overruled += int((decisions.proposed != decisions.action).sum())
        restart[:] = False
    assert overruled > 20


def test_it_rests_on_the_assumptions_that_it_is_given(situation: Make) -> None:
    # Going takes 2.8636 s + 0.1 s; the vehicle is there in 21 / 7 = 3 s, with an error sooner.
    s = situation([AT_THE_ZONE], [{**COMING, "m": 24.0}])
    assert policy(0.0, 0.0, 1.0).decide(s, NEW).action[0] == Action.FAST
    wary = SafetyAssumptions(position_error_m=1.0)
    unsure = SoundLearnedPolicy(Wants(0.0, 0.0, 1.0), "wary", "", assumptions=wary)
    assert unsure.assumptions == wary
    assert unsure.decide(s, NEW).action[0] == Action.STOP


@pytest.mark.parametrize(
    ("values", "what"), [((0.0, float("nan"), 0.0), "not finite"), ((0.0, 0.0), "shape")]
)
def test_values_that_cannot_be_used_are_refused(
    situation: Make, values: tuple[float, ...], what: str
) -> None:
    with pytest.raises(PolicyError, match=what):
        policy(*values).decide(situation([AT_THE_ZONE]), NEW)
