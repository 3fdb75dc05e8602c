# SPDX-License-Identifier: Apache-2.0
"""The supervisor around policies that want the wrong thing."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from risk_dqn_planner.decision import explain
from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import (
    Action,
    Decisions,
    Policy,
    Reason,
    StopsAtGoal,
    Supervision,
)
from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.supervised import Supervisor, SupervisorMode, supervisor_mode
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
AT_THE_ZONE: dict[str, Any] = {"id": 3, "ego_m": 3.15}
COMING: dict[str, Any] = {"id": 8, "lane": 3, "m": 20.0, "mps": 7.0}
NEW, KEPT = np.array([True]), np.array([False])


def decide(
    s: Situations, wanted: Action, mode: SupervisorMode = SupervisorMode.ENFORCE
) -> tuple[Decisions, Supervisor]:
    supervisor = Supervisor(ConstantPolicy(wanted), mode)
    return supervisor.decide(s, NEW), supervisor


def test_a_sound_action_stays_as_it_is(situation: Make) -> None:
    decisions, _ = decide(situation([AT_THE_ZONE]), Action.SLOW)
    assert decisions.action[0] == Action.SLOW
    assert decisions.reason[0] == Reason.FIXED
    assert decisions.supervision is not None
    assert decisions.supervision[0] == Supervision.AGREED


def test_an_enforcing_supervisor_replaces_what_is_not_sound_and_says_why(situation: Make) -> None:
    s = situation([AT_THE_ZONE], [COMING])
    decisions, supervisor = decide(s, Action.FAST)
    assert decisions.action[0] == Action.STOP
    decision = explain(decisions, s, 0, supervisor)
    assert decision.supervision is Supervision.OVERRULED
    assert decision.proposed is Action.FAST
    assert decision.reason is Reason.VEHICLE
    assert decision.critical_vehicle_id == 8
    # 17 / 7 = 2.4286 s less 2.8636 + 0.1 s, see test_joint_check.
    assert decision.explanation.lacking_s == pytest.approx(0.535, abs=1e-3)
    assert decision.text == (
        "STOP: supervisor overrules FAST; vehicle 8 reaches conflict zone of lane 3 in 2.4 s, "
        "leaving takes 2.9 s (gap wanted 0.1 s)"
    )


def test_a_reporting_supervisor_lets_it_pass_and_says_so(situation: Make) -> None:
    s = situation([AT_THE_ZONE], [COMING])
    decisions, supervisor = decide(s, Action.FAST, SupervisorMode.REPORT)
    assert decisions.action[0] == Action.FAST
    decision = explain(decisions, s, 0, supervisor)
    assert decision.supervision is Supervision.OBJECTED
    assert decision.reason is Reason.FIXED
    assert "FAST: supervisor objects; vehicle 8" in decision.text


def test_a_supervisor_that_is_off_is_not_there(situation: Make) -> None:
    s = situation([AT_THE_ZONE], [COMING])
    decisions, supervisor = decide(s, Action.FAST, SupervisorMode.OFF)
    assert decisions.supervision is None
    assert explain(decisions, s, 0, supervisor).supervision is Supervision.OFF
    assert supervisor.name == "always_fast"
    assert supervisor.hash == ConstantPolicy(Action.FAST).hash


def test_the_fastest_sound_action_below_the_proposed_one_stands_in(situation: Make) -> None:
    # Slow is sound here and Fast is not, see test_fastest_sound.
    s = situation([{"id": 3, "ego_m": 8.5, "hidden_m": -3.0}], ego_mps=5.0)
    assert decide(s, Action.FAST)[0].action[0] == Action.SLOW


class Valued:
    """A policy that wants what its Q values say."""

    name = hash = "valued"

    def __init__(self, *q_values: float) -> None:
        self._q_values = np.array([q_values])

    def decide(self, situations: Situations, restart: NDArray[np.bool_]) -> Decisions:
        decisions = ConstantPolicy(Action.STOP).decide(situations, restart)
        return decisions._replace(action=self._q_values.argmax(axis=1), q_values=self._q_values)


@pytest.mark.parametrize(
    ("q_values", "expected"),
    [((1.0, 0.0, 2.0), Action.STOP), ((0.0, 1.0, 2.0), Action.SLOW), ((0.0, 2.0, 1.0), 1)],
)
def test_of_sound_actions_that_with_the_highest_value_stands_in(
    situation: Make, q_values: tuple[float, ...], expected: Action
) -> None:
    # Stop and Slow are sound here and Fast is not, see test_fastest_sound.
    s = situation([{"id": 3, "ego_m": 8.5, "hidden_m": -3.0}], ego_mps=5.0)
    assert Supervisor(Valued(*q_values)).decide(s, NEW).action[0] == expected


def test_where_stopping_is_not_sound_the_ego_is_driven_on(situation: Make) -> None:
    # In the zone at 2 m/s, the other will be there in 2 s. Going on takes 1.33 s; stopping for a
    # period and going then would take 2.48 s, Slow 2.05 s.
    s = situation([{"id": 3, "ego_m": 1.0}], [COMING | {"m": 17.0}], ego_mps=2.0)
    decisions, supervisor = decide(s, Action.STOP)
    assert decisions.action[0] == Action.FAST
    decision = explain(decisions, s, 0, supervisor)
    assert decision.proposed is Action.STOP
    assert decision.explanation.considered is Action.STOP
    assert decision.text.startswith("FAST: supervisor overrules STOP; vehicle 8 ")


def test_an_action_once_found_sound_is_carried_on_when_nothing_is(situation: Make) -> None:
    entering = situation([{"id": 3, "ego_m": 2.5}], ego_mps=4.0)
    hidden = situation([{"id": 3, "ego_m": 0.5, "hidden_m": 4.0}], ego_mps=4.5)
    supervisor = Supervisor(ConstantPolicy(Action.FAST))
    supervisor.decide(entering, NEW)
    decisions = supervisor.decide(hidden, KEPT)
    assert decisions.action[0] == Action.FAST
    assert decisions.supervision is not None
    assert decisions.supervision[0] == Supervision.AGREED


def test_at_the_goal_nothing_is_overruled(situation: Make) -> None:
    s = situation([{"id": 3, "ego_m": 1.0}], [COMING], goal_m=0.0, ego_mps=2.0)
    supervisor = Supervisor(StopsAtGoal(ConstantPolicy(Action.FAST)))
    decisions = supervisor.decide(s, NEW)
    assert decisions.action[0] == Action.STOP
    assert decisions.reason[0] == Reason.GOAL_REACHED


def test_rows_do_not_disturb_each_other(random_situations: Make) -> None:
    together = Supervisor(ConstantPolicy(Action.FAST))
    alone = [Supervisor(ConstantPolicy(Action.FAST)) for _ in range(50)]
    for seed in range(3):
        batch = random_situations(seed, 50)
        actions = together.decide(batch, np.full(50, seed == 0)).action
        for row in range(50):
            one = Situations._make(field[row : row + 1] for field in batch)
            assert alone[row].decide(one, np.array([seed == 0])).action[0] == actions[row]


def test_name_and_hash_tell_an_enforcing_supervisor() -> None:
    policy: Policy = ConstantPolicy(Action.FAST)
    assert Supervisor(policy).name == "always_fast+supervisor"
    assert Supervisor(policy).hash != policy.hash
    assert Supervisor(policy, SupervisorMode.REPORT).hash == policy.hash


def test_modes_are_known_by_name() -> None:
    assert supervisor_mode("enforce") is SupervisorMode.ENFORCE
    with pytest.raises(ConfigurationError, match="'on', expected one of: off, report, enforce"):
        supervisor_mode("on")
