# SPDX-License-Identifier: Apache-2.0
"""Bounds on others' speeds: by hand, and the truth inside whatever keeps the assumptions."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.safety.speeds import SpeedBounds, Speeds
from risk_dqn_planner.situation.situations import Booleans, Situations, empty_situations

Make = Callable[..., Situations]
LANE: dict[str, Any] = {"id": 3, "ego_m": 13.0}
NEW, KEPT = np.array([True]), np.array([False])
NOISY = SafetyAssumptions(speed_error_mps=4.0, period_error_s=0.0)
LIMIT_MPS = 7.0
PERIODS, VEHICLES, PIECES = 6, 40, 4


def bounds(speeds: Speeds) -> list[float]:
    return [float(part[0, 0]) for part in speeds]


def seen(situation: Make, place_m: float, mps: float, id_: int = 8) -> Situations:
    return situation([LANE], [{"id": id_, "lane": 3, "m": place_m, "mps": mps}])


def test_the_first_measurement_is_off_by_its_error_but_keeps_to_the_limit(situation: Make) -> None:
    assert bounds(SpeedBounds(NOISY).look(seen(situation, 40.0, 5.0), NEW)) == [1.0, 7.0, 5.0]
    # Who is over the limit for certain may be as fast as measured.
    assert bounds(SpeedBounds(NOISY).look(seen(situation, 40.0, 12.0), NEW)) == [8.0, 16.0, 12.0]


def test_the_way_covered_bounds_the_speed(situation: Make) -> None:
    memory = SpeedBounds(NOISY)
    memory.look(seen(situation, 40.0, 3.0), NEW)
    # 2.5 m in 0.5 s, places off by 0.2 m each: at most 5.8 m/s on average, and 2 m/s^2 x 0.25 s
    # more at the end.
    found = bounds(memory.look(seen(situation, 37.5, 3.5), KEPT))
    assert found == pytest.approx([0.0, 6.3, 5.0])


def test_who_hardly_moved_has_set_off_at_most(situation: Make) -> None:
    memory = SpeedBounds(NOISY)
    memory.look(seen(situation, 20.0, 2.0), NEW)
    # At most 0.2 m, -0.2 m seen and 0.2 m off at either end: sqrt(2 x 2 x 0.2).
    assert bounds(memory.look(seen(situation, 20.2, 2.0), KEPT))[1] == pytest.approx(0.894427)


def test_the_way_on_the_lane_it_follows_counts_on_all_others(situation: Make) -> None:
    memory = SpeedBounds(NOISY)
    lanes = [LANE, {"id": 4, "ego_m": 17.0}]

    def on_both(first_m: float, second_m: float) -> Situations:
        at = ({"lane": 3, "m": first_m}, {"lane": 4, "m": second_m})
        return situation(lanes, [{"id": 8, "mps": 3.0, **where} for where in at])

    memory.look(on_both(40.0, 30.0), NEW)
    # On the second lane it seems to stand, as another way through it is longer.
    found = memory.look(on_both(37.5, 30.0), KEPT)
    assert found.high_mps[0, :2].tolist() == pytest.approx([6.3, 6.3])


def test_an_earlier_bound_holds_for_as_long_as_it_takes_to_speed_up(situation: Make) -> None:
    memory = SpeedBounds(NOISY)
    memory.look(seen(situation, 20.0, -3.0), NEW)
    # It was no faster than 1 m/s, so that it is no faster than 2 m/s, though it covered 2 m.
    assert bounds(memory.look(seen(situation, 18.0, 0.0), KEPT))[1] == pytest.approx(2.0)


def test_a_jump_to_another_way_counts_as_a_first_look(situation: Make) -> None:
    for jump_m in (-3.0, 8.0):
        memory = SpeedBounds(NOISY)
        memory.look(seen(situation, 30.0, 5.0), NEW)
        assert bounds(memory.look(seen(situation, 30.0 - jump_m, 4.0), KEPT))[:2] == [0.0, 7.0]


@pytest.mark.parametrize("restart", [NEW, KEPT])
def test_nothing_is_learnt_of_another_vehicle_nor_from_before_a_restart(
    situation: Make, restart: Booleans
) -> None:
    memory = SpeedBounds(NOISY)
    memory.look(seen(situation, 40.0, 5.0), NEW)
    other = 8 if restart[0] else 9
    assert bounds(memory.look(seen(situation, 37.5, 5.0, other), restart)) == [1.0, 7.0, 5.0]


def test_ways_say_nothing_where_the_time_between_is_unknown(situation: Make) -> None:
    memory = SpeedBounds(SafetyAssumptions(speed_error_mps=4.0))
    memory.look(seen(situation, 40.0, 5.0), NEW)
    assert bounds(memory.look(seen(situation, 39.0, 5.0), KEPT)) == [1.0, 7.0, 5.0]


def test_without_errors_speeds_are_what_is_measured(situation: Make) -> None:
    memory = SpeedBounds(SafetyAssumptions(period_error_s=0.0))
    memory.look(seen(situation, 40.0, 5.0), NEW)
    assert bounds(memory.look(seen(situation, 39.0, 9.0), KEPT)) == [9.0, 9.0, 9.0]


def test_rows_and_their_order_make_no_difference(random_situations: Make) -> None:
    together, alone = SpeedBounds(NOISY), [SpeedBounds(NOISY) for _ in range(20)]
    picked = SpeedBounds(NOISY)
    restart, rows = np.ones(20, dtype=np.bool_), np.arange(20)[::-1].copy()
    s = random_situations(1, 20)
    together.look(s, restart)
    picked.look(Situations._make(part[rows] for part in s), restart)
    picked.keep(rows)
    restart[:] = False
    moved = s._replace(vehicle_distance_m=s.vehicle_distance_m - 1.5)
    for row, memory in enumerate(alone):
        memory.look(Situations._make(part[row : row + 1] for part in s), NEW)
    found, again = together.look(moved, restart), picked.look(moved, restart)
    for row, memory in enumerate(alone):
        one = Situations._make(part[row : row + 1] for part in moved)
        for part, single in zip(found, memory.look(one, KEPT), strict=True):
            np.testing.assert_array_equal(part[row], single[0])
    for part, same in zip(found, again, strict=True):
        np.testing.assert_array_equal(part, same)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    jitter_s=st.sampled_from([0.0, 0.1, 0.3]),
    position_error_m=st.sampled_from([0.0, 0.3]),
    factor=st.sampled_from([1.0, 1.2]),
)
def test_the_truth_is_always_inside_while_the_assumptions_hold(
    seed: int, jitter_s: float, position_error_m: float, factor: float
) -> None:
    assumptions = SafetyAssumptions(
        speed_error_mps=2.0,
        period_error_s=jitter_s,
        position_error_m=position_error_m,
        speed_limit_factor=factor,
    )
    rng, memory = np.random.default_rng(seed), SpeedBounds(assumptions)
    top_mps, ids = LIMIT_MPS * factor, rng.permutation(VEHICLES)
    place_m, mps = rng.uniform(10.0, 90.0, VEHICLES), rng.uniform(0.0, top_mps, VEHICLES)
    extreme = rng.random() < 0.5  # errors and accelerations at their ends as well as in between
    for step in range(PERIODS):
        errors = rng.uniform(-1.0, 1.0, (2, VEHICLES))
        errors = np.sign(errors) if extreme else errors
        s = empty_situations(1, VEHICLES, 1)
        s.vehicle_mask[:], s.lane_mask[:], s.lane_speed_limit_mps[:] = True, True, LIMIT_MPS
        s.vehicle_id[0] = ids
        s.vehicle_distance_m[0] = place_m + position_error_m * errors[0]
        s.vehicle_speed_mps[0] = mps + 2.0 * errors[1]
        found = memory.look(s, np.array([step == 0]))
        assert (found.low_mps[0] <= mps + 1e-9).all()
        assert (mps <= found.high_mps[0] + 1e-9).all()
        assert (found.low_mps <= found.likely_mps).all()
        assert (found.likely_mps <= found.high_mps).all()
        time_s = 0.5 + jitter_s * rng.uniform(-1.0, 1.0)
        for _ in range(PIECES):
            up, down = rng.uniform(0.0, 2.0, VEHICLES), rng.uniform(0.0, 8.0, VEHICLES)
            up, down = (np.full(VEHICLES, 2.0), np.full(VEHICLES, 8.0)) if extreme else (up, down)
            goal_mps = rng.choice([0.0, top_mps], VEHICLES)
            place_m = place_m - distance_after(time_s / PIECES, mps, goal_mps, up, down)
            mps = speed_after(time_s / PIECES, mps, goal_mps, up, down)


def test_the_guard_finds_sound_what_one_measurement_cannot(situation: Make) -> None:
    # 6.1 m through the zone from rest take 2.85 s; at 11 m/s, if measured at 7, it needs 2.1 s.
    guard = Guard(NOISY)
    near = situation([{"id": 3, "ego_m": 3.1}], [{"id": 8, "lane": 3, "m": 27.0, "mps": 3.0}])
    nearer = situation([{"id": 3, "ego_m": 3.1}], [{"id": 8, "lane": 3, "m": 25.5, "mps": 3.0}])
    far = NOISY.speed_error_mps + 3.0
    assert far == LIMIT_MPS
    check = guard.look(near, NEW)
    guard.decided(check, np.array([0]))
    first = Guard(NOISY).look(nearer, NEW).margin_s[0, 2]
    assert guard.look(nearer, KEPT).margin_s[0, 2] > first + 0.2
