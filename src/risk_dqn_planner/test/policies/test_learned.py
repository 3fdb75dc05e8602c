# SPDX-License-Identifier: Apache-2.0
from collections.abc import Callable

import numpy as np
import pytest
import torch

from risk_dqn_planner.errors import PolicyError
from risk_dqn_planner.policies.base import Action, Reason
from risk_dqn_planner.policies.learned import LearnedPolicy
from risk_dqn_planner.policies.network import RiskDqn
from risk_dqn_planner.policies.rule_based import RuleBasedPolicy
from risk_dqn_planner.situation.situations import Situations
from risk_dqn_planner.state.encoding import StateConfig

Make = Callable[..., Situations]


class Spy(torch.nn.Module):
    """Gives set values and keeps what it was shown."""

    def __init__(self, values: list[float]) -> None:
        super().__init__()
        self.values = torch.tensor(values)
        self.seen = torch.empty(0)

    def forward(self, state: torch.Tensor) -> torch.Tensor:
        self.seen = state.clone()
        return self.values.expand(state.shape[0], len(self.values))


def policy_of(network: torch.nn.Module, state: StateConfig | None = None) -> LearnedPolicy:
    return LearnedPolicy(network, "spy", "0" * 64, state)


@pytest.mark.parametrize("action", list(Action))
def test_the_highest_value_wins(situation: Make, action: Action) -> None:
    values = [0.1, 0.1, 0.1]
    values[action] = 0.5
    decisions = policy_of(Spy(values)).decide(situation(), np.ones(1, dtype=bool))
    assert decisions.action[0] == action
    assert decisions.reason[0] == Reason.LEARNED
    np.testing.assert_allclose(decisions.q_values[0], values, rtol=1e-6)


def test_it_remembers_what_it_has_seen_until_a_restart(situation: Make) -> None:
    network = Spy([0.0, 0.0, 1.0])
    policy = policy_of(network)
    for speed, restart in ((1.0, True), (2.0, False), (3.0, False)):
        policy.decide(situation(ego_mps=speed), np.array([restart]))
    np.testing.assert_allclose(network.seen[0, :, 1, 0] * 5.0, [3, 2, 1, 1, 1], rtol=1e-6)
    policy.decide(situation(ego_mps=4.0), np.array([True]))
    np.testing.assert_allclose(network.seen[0, :, 1, 0] * 5.0, [4] * 5, rtol=1e-6)


def test_states_are_normalised_as_configured(situation: Make) -> None:
    network = Spy([0.0, 0.0, 1.0])
    s = situation(ego_mps=5.0)
    policy_of(network, StateConfig(ego_speed_max_mps=10.0)).decide(s, np.ones(1, dtype=bool))
    assert network.seen[0, 0, 1, 0] == 0.5


def test_risks_are_those_of_the_rule(random_situations: Make) -> None:
    s, restart = random_situations(seed=2, batch=50), np.ones(50, dtype=bool)
    learned = policy_of(Spy([0.0, 1.0, 0.0])).decide(s, restart)
    rule = RuleBasedPolicy().decide(s, restart)
    np.testing.assert_array_equal(learned.action_risks, rule.action_risks)
    # Both chose Slow here: the same vehicles and lanes keep them from going faster.
    slow = rule.action == Action.SLOW
    assert slow.any()
    np.testing.assert_array_equal(learned.critical_lane[slow], rule.critical_lane[slow])
    np.testing.assert_array_equal(learned.critical_vehicle[slow], rule.critical_vehicle[slow])


def test_a_risky_fast_names_what_makes_it_risky(situation: Make) -> None:
    vehicle = {"id": 9, "lane": 3, "m": 20.0, "mps": 7.0}
    s = situation([{"id": 3, "ego_m": 5.5}], [vehicle])
    decisions = policy_of(Spy([0.0, 0.0, 1.0])).decide(s, np.ones(1, dtype=bool))
    assert decisions.action_risks[0, Action.FAST] > 0.0
    assert (decisions.critical_vehicle[0], decisions.critical_lane[0]) == (0, 0)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_values_that_are_not_finite_are_refused(situation: Make, value: float) -> None:
    with pytest.raises(PolicyError, match="spy gives Q values that are not finite"):
        policy_of(Spy([0.0, value, 0.0])).decide(situation(), np.ones(1, dtype=bool))


def test_a_wrong_number_of_values_is_refused(situation: Make) -> None:
    with pytest.raises(PolicyError, match="expected"):
        policy_of(Spy([0.0, 1.0])).decide(situation(), np.ones(1, dtype=bool))


def test_a_row_of_a_batch_is_a_batch_of_one(random_situations: Make) -> None:
    torch.manual_seed(0)
    network = RiskDqn().eval()
    whole, alone = policy_of(network), [policy_of(network) for _ in range(6)]
    for step in range(6):
        s, restart = random_situations(seed=step, batch=6), np.full(6, step == 0)
        many = whole.decide(s, restart)
        for i in range(6):
            row = Situations._make(field[i : i + 1] for field in s)
            one = alone[i].decide(row, restart[i : i + 1])
            # Matrix products of other sizes may sum in another order.
            np.testing.assert_allclose(one.q_values[0], many.q_values[i], rtol=1e-4, atol=1e-6)
            assert one.action[0] == many.action[i]
