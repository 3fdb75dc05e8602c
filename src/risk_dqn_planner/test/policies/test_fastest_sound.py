# SPDX-License-Identifier: Apache-2.0
"""The fastest admissible action; the check itself is tested in test/safety."""

from collections.abc import Callable
from typing import Any

import numpy as np

from risk_dqn_planner.decision import explain
from risk_dqn_planner.policies.base import Action, Decisions, Reason
from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
AT_THE_ZONE: dict[str, Any] = {"id": 3, "ego_m": 3.15}
NEW, KEPT = np.array([True]), np.array([False])


def chosen(decisions: Decisions) -> tuple[Action, Reason, int, int]:
    return (
        Action(int(decisions.action[0])),
        Reason(int(decisions.reason[0])),
        int(decisions.critical_vehicle[0]),
        int(decisions.critical_lane[0]),
    )


def test_it_goes_fast_where_that_is_sound(situation: Make) -> None:
    decisions = FastestSoundPolicy().decide(situation([AT_THE_ZONE]), NEW)
    assert chosen(decisions) == (Action.FAST, Reason.CLEAR, -1, -1)
    assert decisions.action_risks[0].tolist() == [0.0, 0.0, 0.0]


def test_it_stops_for_a_vehicle_and_says_so(situation: Make) -> None:
    # 20.745 m before its zone at 7 m/s would do, see test_joint_check.
    s = situation([AT_THE_ZONE], [{"id": 8, "lane": 3, "m": 20.0, "mps": 7.0}])
    policy = FastestSoundPolicy()
    decisions = policy.decide(s, NEW)
    assert chosen(decisions) == (Action.STOP, Reason.VEHICLE, 0, 0)
    assert decisions.action_risks[0].tolist() == [0.0, 1.0, 1.0]
    text = explain(decisions, s, 0, policy).text
    assert text.startswith("STOP: vehicle 8 reaches conflict zone of lane 3 in 2.4 s")


def test_it_slows_down_where_fast_could_not_stop_any_more(situation: Make) -> None:
    # At 5 m/s, 5.5 m before an occupied zone. Fast: 2.5 m and 3.571 m of braking, too far. Slow:
    # 2.0625 m, then from 3.25 m/s 1.509 m.
    s = situation([{"id": 3, "ego_m": 8.5, "hidden_m": -3.0}], ego_mps=5.0)
    decisions = FastestSoundPolicy().decide(s, NEW)
    assert chosen(decisions) == (Action.SLOW, Reason.HIDDEN_VEHICLE, -1, 0)


def test_without_an_admissible_action_it_carries_on_with_what_was_verified(
    situation: Make,
) -> None:
    # On its way through the zone, a place nearby that was free is hidden all at once.
    policy = FastestSoundPolicy()
    entering = situation([{"id": 3, "ego_m": 2.5}], ego_mps=4.0)
    assert chosen(policy.decide(entering, NEW))[0] == Action.FAST
    hidden = situation([{"id": 3, "ego_m": 0.5, "hidden_m": 4.0}], ego_mps=4.5)
    decisions = policy.decide(hidden, KEPT)
    assert decisions.action_risks[0].tolist() == [1.0, 1.0, 1.0]
    assert chosen(decisions) == (Action.FAST, Reason.HIDDEN_VEHICLE, -1, 0)
    # Had it begun there, braking would be all that is known.
    assert chosen(FastestSoundPolicy().decide(hidden, NEW))[0] == Action.STOP


def test_rows_of_a_batch_do_not_disturb_each_other(random_situations: Make) -> None:
    together, restart = FastestSoundPolicy(), np.ones(50, dtype=bool)
    alone = [FastestSoundPolicy() for _ in range(50)]
    for seed in range(3):
        batch = random_situations(seed, 50)
        decisions = together.decide(batch, restart)
        for row in range(50):
            one = Situations._make(field[row : row + 1] for field in batch)
            single = alone[row].decide(one, restart[:1])
            for field, fields in zip(single[:6], decisions[:6], strict=True):
                np.testing.assert_array_equal(field[0], fields[row])
        restart = restart & False


def test_it_is_known_by_name_and_its_hash_by_its_assumptions() -> None:
    policy = load_policy("fastest_sound")
    assert policy.name == "fastest_sound"
    assert policy.hash == FastestSoundPolicy().hash
    assert policy.hash != FastestSoundPolicy(SafetyAssumptions(safe_gap_s=0.2)).hash
