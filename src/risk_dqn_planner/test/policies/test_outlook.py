# SPDX-License-Identifier: Apache-2.0
"""What a network is told beyond the state, against numbers by hand and against the joint check."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.policies.foresight.forecast import nearing_speed, reached, travelled
from risk_dqn_planner.policies.outlook import Outlook, OutlookConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.situation.situations import Situations

Make = Callable[..., Situations]
# At rest 0.15 m before the zone: through it, 6.15 m, in sqrt(2 x 6.15 / 1.5) = 2.8636 s.
AT_THE_ZONE: dict[str, Any] = {"id": 3, "ego_m": 3.15}
THROUGH_S = 2.8636
COMING: dict[str, Any] = {"id": 8, "lane": 3, "m": 20.0, "mps": 7.0}
HOPS = 93
NEW, KEPT = np.array([True]), np.array([False])


def test_it_says_what_is_in_force_and_what_is_sound(situation: Make) -> None:
    outlook, s = Outlook(), situation([AT_THE_ZONE], [COMING])
    views = outlook.look(s, NEW)
    assert views.inputs[0, :6].tolist() == [1.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    assert views.sound[0].tolist() == [True, False, False]
    free = situation([AT_THE_ZONE])
    outlook.decided(outlook.look(free, NEW), np.array([Action.SLOW]))
    assert outlook.look(free, KEPT).inputs[0, :6].tolist() == [0.0, 1.0, 0.0, 1.0, 1.0, 1.0]


def test_the_margin_of_going_is_the_time_that_is_missing(situation: Make) -> None:
    views = Outlook().look(situation([AT_THE_ZONE], [COMING]), NEW)
    # It arrives after 17 m at 7 m/s; 0.1 s is the gap wanted, and margins are divided by 4 s.
    missing_s = 17.0 / 7.0 - THROUGH_S - 0.1
    assert views.inputs[0, 6 + Action.FAST] == pytest.approx(missing_s / 4.0, abs=1e-4)


def test_the_forecast_sees_the_gap_behind_a_vehicle_that_passes(situation: Make) -> None:
    later = Outlook().look(situation([AT_THE_ZONE], [COMING]), NEW).inputs[0, 13:53].reshape(5, 8)
    # Half a second on it is 3.5 m nearer; after 3 s it is in the zone, after 3.5 s it has left.
    assert later[0, 0] == pytest.approx((13.5 / 7.0 - THROUGH_S - 0.1) / 4.0, abs=1e-4)
    assert later[0, 5] == pytest.approx((-THROUGH_S - 0.1) / 4.0, abs=1e-4)
    assert later[0, 6:].tolist() == [1.0, 1.0]


@pytest.mark.parametrize(("leader_m", "joins"), [(-12.0, True), (-2.0, False)])
def test_it_tells_whether_a_lane_can_be_joined_behind_a_leader(
    situation: Make, leader_m: float, joins: bool
) -> None:
    # At rest 0.2 m before a lane in which somebody stands: going on for ever never is safe.
    lane = {"id": 3, "ego_m": 3.2, "merging": True}
    leader = {"id": 7, "lane": 3, "m": leader_m, "mps": 0.0}
    told = Outlook().look(situation([lane], [leader], goal_m=30.0), NEW).inputs[0]
    assert (told[6 + Action.FAST] >= 0.0) == joins
    assert (told[53:93] == float(joins)).all()


def test_it_says_which_margins_are_enough(random_situations: Make) -> None:
    inputs = Outlook().look(random_situations(2, 300), np.ones(300, dtype=np.bool_)).inputs
    margins, enough = inputs[:, 13:53], inputs[:, 53:HOPS]
    assert set(np.unique(enough)) == {0.0, 1.0}
    np.testing.assert_array_equal(enough, margins >= -1e-6 / 4.0)


def test_who_creeps_forward_needs_a_shorter_gap_or_is_in_the_way(situation: Make) -> None:
    far = {"id": 3, "ego_m": 13.0}
    later = Outlook().look(situation([far], [{**COMING, "m": 45.0}]), NEW).inputs[0, 13:53]
    waiting, creeping, nearing, stopped, slowed = later.reshape(5, 8)
    assert nearing[3] > creeping[3] > waiting[3]
    # Who comes nearer after a period of Stop is behind; from rest Slow and Fast begin alike.
    assert slowed[3] == nearing[3] > stopped[3] > waiting[3]
    assert (stopped[0], slowed[0]) == (waiting[0], creeping[0])


def test_it_tells_how_far_the_next_place_to_wait_is(situation: Make) -> None:
    # The zone of 6 m begins 10 m ahead, the margin before it is 0.1 m.
    views = Outlook().look(situation([{"id": 3, "ego_m": 13.0}]), NEW)
    ways = [np.sqrt(9.9 / 40.0), np.sqrt(9.9 / 40.0), 6.1 / 20.0, 0.0]
    assert views.inputs[0, 9:13].tolist() == pytest.approx(ways, abs=1e-6)
    nothing_ahead = Outlook().look(situation(), NEW)
    assert nothing_ahead.inputs[0, 9:13].tolist() == [1.0, 1.0, 0.0, 0.0]


def test_it_tells_what_hops_can_fill_of_the_way_to_the_next_place(situation: Make) -> None:
    # At rest 0.9 m before the place. Slow takes it 0.1875 m and reaches 0.75 m/s; braking 0.0804 m.
    left_m = 0.9 - (0.1875 + 0.75**2 / 7.0)
    hops = Outlook().look(situation([{"id": 3, "ego_m": 4.0}]), NEW).inputs[0, HOPS:]
    assert hops[1:4].tolist() == pytest.approx([0.3, left_m / 3.0, left_m / 3.0], abs=1e-4)
    # Three hops of 0.27 m from 0.9 m, or one and two more, leave 0.09 m of it.
    assert hops[4:].tolist() == pytest.approx([0.3, 0.3, 0.3], abs=1e-6)


def test_nothing_is_crept_to_where_no_place_is_ahead(situation: Make) -> None:
    hops = Outlook().look(situation(), NEW).inputs[0, HOPS:]
    assert hops.tolist() == [0.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0]


def test_it_creeps_where_a_corner_hides_a_lane(situation: Make) -> None:
    hidden = {"id": 3, "ego_m": 4.0, "hidden_m": 12.0}
    seen = {"id": 3, "ego_m": 4.0}
    assert Outlook().look(situation([hidden]), NEW).inputs[0, HOPS] == 1.0
    assert Outlook().look(situation([seen]), NEW).inputs[0, HOPS] == 0.0


def test_who_comes_nearer_rests_before_the_zone() -> None:
    p = SafetyAssumptions().numbers()
    way_m, mps = 0.0, 3.0
    for _ in range(20):
        target_mps = nearing_speed(way_m, mps, 7.0, p)
        way_m += travelled(mps, target_mps, p.period_s, p)
        mps = reached(mps, target_mps, p.period_s, p)
    assert mps == 0.0
    assert 6.0 < way_m <= 7.0


def test_sound_is_what_the_guard_calls_sound(random_situations: Make) -> None:
    outlook, guard, restart = Outlook(), Guard(), np.ones(200, dtype=np.bool_)
    for seed in range(3):
        s = random_situations(seed, 200)
        views, check = outlook.look(s, restart), guard.look(s, restart)
        np.testing.assert_array_equal(views.sound, guard.sound(check))
        action = views.sound.argmax(axis=1)
        outlook.decided(views, action)
        guard.decided(check, action)
        restart[:] = False


def test_all_numbers_are_between_minus_one_and_one(random_situations: Make) -> None:
    inputs = Outlook().look(random_situations(4, 500), np.ones(500, dtype=np.bool_)).inputs
    assert inputs.shape == (500, OutlookConfig().size) == (500, 100)
    assert np.isfinite(inputs).all()
    assert np.abs(inputs).max() <= 1.0


def test_rows_of_a_batch_do_not_disturb_each_other(random_situations: Make) -> None:
    together, alone = Outlook(), [Outlook() for _ in range(40)]
    restart = np.ones(40, dtype=np.bool_)
    for seed in range(3):
        batch = random_situations(seed, 40)
        views = together.look(batch, restart)
        action = views.sound.argmax(axis=1)
        together.decided(views, action)
        for row in range(40):
            one = Situations._make(field[row : row + 1] for field in batch)
            single = alone[row].look(one, restart[:1])
            alone[row].decided(single, action[row : row + 1])
            np.testing.assert_array_equal(single.inputs[0], views.inputs[row])
        restart[:] = False


def test_its_assumptions_decide_the_margins(situation: Make) -> None:
    s = situation([AT_THE_ZONE], [COMING])
    wary = Outlook(SafetyAssumptions(safe_gap_s=0.5))
    assert wary.assumptions.safe_gap_s == 0.5
    less = Outlook().look(s, NEW).inputs[0, 6 + Action.FAST] - wary.look(s, NEW).inputs[0, 8]
    assert less == pytest.approx(0.4 / 4.0, abs=1e-4)


@pytest.mark.parametrize(
    ("name", "value"),
    [("periods", 0), ("most_s", 0.0), ("most_m", -1.0), ("nearest_corner_m", -1.0)],
)
def test_a_number_that_makes_no_sense_is_refused_by_its_name(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=f"OutlookConfig.{name} is"):
        OutlookConfig(**{name: value})  # type: ignore[arg-type]
