# SPDX-License-Identifier: Apache-2.0
"""Selection, layout and history of the state."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from risk_dqn_planner.errors import InputError
from risk_dqn_planner.situation.situations import Situations
from risk_dqn_planner.state.encoding import StateConfig
from risk_dqn_planner.state.history import StateEncoder

Make = Callable[..., Situations]
LANE: dict[str, Any] = {"id": 3, "ego_m": 17.5}


def encode_all(
    scenes: Sequence[Situations], config: StateConfig | None = None
) -> NDArray[np.float32]:
    """The state after the last of some scenes of one episode, (5, 3, 8)."""
    encoder = StateEncoder(config)
    out = np.empty((1, 5, 3, 8), dtype=np.float32)
    for i, scene in enumerate(scenes):
        encoder.encode(scene, np.array([i == 0]), out)
    state: NDArray[np.float32] = out[0]
    return state


def test_a_scene_is_laid_out_as_in_the_paper(situation: Make) -> None:
    s = situation(
        [LANE | {"hidden_m": 35.0, "limit_mps": 7.5}],
        [{"id": 1, "lane": 3, "m": -70.0 / 4.0, "mps": 3.0}],
        stop_line_m=70.0 / 16.0,
        goal_m=36.0,
        ego_mps=2.5,
    )
    scene = encode_all([s])[0]
    np.testing.assert_allclose(scene[:, 0], [0.25, 0.5, 0.6])
    np.testing.assert_allclose(scene[:, 1], [-0.5, 0.2, 0.5], rtol=1e-6)
    np.testing.assert_allclose(scene[:, 6], [np.sqrt(0.5), 0.5, 0.5], rtol=1e-6)


def test_missing_vehicles_and_lanes_are_far_and_slow(situation: Make) -> None:
    state = encode_all([situation()] * 6)
    for column in range(1, 8):
        np.testing.assert_array_equal(state[:, :, column], [[1.0, 0.0, 1.0]] * 5)


def vehicle(number: int, m: float, lane: int = 3, mps: float = 15.0) -> dict[str, Any]:
    return {"id": number, "lane": lane, "m": m, "mps": mps}


def distances_m(state: NDArray[np.float32]) -> list[float]:
    """d_i of the five vehicles of a scene."""
    return [round(float(y) ** 2 * 70.0 * float(np.sign(y)), 3) for y in state[0, 1:6]]


def test_the_five_most_critical_vehicles_are_kept_best_first(situation: Make) -> None:
    s = situation([LANE], [vehicle(i, m) for i, m in enumerate([60, 5, 40, -2, 20, 50, 30])])
    assert distances_m(encode_all([s])[0]) == [-2.0, 5.0, 20.0, 30.0, 40.0]


def test_criticality_weighs_the_egos_distance_too(situation: Make) -> None:
    # Sums of the shares of d_max: 30 + 17.5 on lane 3, 10 + 40 on lane 4.
    s = situation([LANE, {"id": 4, "ego_m": 40.0}], [vehicle(1, 10.0, lane=4), vehicle(2, 30.0)])
    assert distances_m(encode_all([s])[0])[:2] == [30.0, 10.0]


def test_ties_go_by_vehicle_then_lane_id(situation: Make) -> None:
    lanes = [LANE, LANE | {"id": 2}]
    speeds = {9: 0.6, 4: 1.5, -7: 3.0}
    s = situation(lanes, [vehicle(i, 90.0, mps=v) for i, v in speeds.items()])
    np.testing.assert_allclose(encode_all([s])[0, 1, 1:4], [0.2, 0.1, 0.04], rtol=1e-6)
    # One vehicle, equally near on both lanes: the lower lane id is remembered.
    on_both = [vehicle(1, 20.0, lane=3, mps=3.0), vehicle(1, 20.0, lane=2, mps=6.0)]
    np.testing.assert_allclose(encode_all([situation(lanes, on_both)])[0, 1, 1], 0.4, rtol=1e-6)


def test_a_vehicle_on_two_lanes_takes_one_slot(situation: Make) -> None:
    lanes = [LANE, {"id": 4, "ego_m": 30.0}]
    vehicles = [vehicle(1, 40.0), vehicle(1, 20.0, lane=4), vehicle(2, 25.0)]
    state = encode_all([situation(lanes, vehicles)])
    # 20 + 30 on lane 4 is more critical than 40 + 17.5 on lane 3.
    assert distances_m(state[0]) == [25.0, 20.0, 70.0, 70.0, 70.0]


def test_the_two_lanes_with_the_most_critical_occlusion_are_kept(situation: Make) -> None:
    lanes = [
        {"id": 1, "ego_m": 10.0, "hidden_m": 70.0},
        {"id": 2, "ego_m": 20.0, "hidden_m": 17.5},
        {"id": 3, "ego_m": 30.0, "hidden_m": 35.0},
    ]
    scene = encode_all([situation(lanes)])[0]
    np.testing.assert_allclose(scene[0, 6:] ** 2, [0.25, 0.5], rtol=1e-6)


def speeds_of_first(state: NDArray[np.float32]) -> list[float]:
    """v_i of the first vehicle over the five scenes, now first [m/s]."""
    return [round(float(y) * 15.0, 3) for y in state[:, 1, 1]]


def test_the_start_repeats_the_oldest_scene(situation: Make) -> None:
    scenes = [
        situation([LANE], [vehicle(1, 20.0, mps=float(t))], ego_mps=float(t)) for t in range(1, 4)
    ]
    state = encode_all(scenes)
    assert speeds_of_first(state) == [3.0, 2.0, 1.0, 1.0, 1.0]
    np.testing.assert_allclose(state[:, 1, 0] * 5.0, [3.0, 2.0, 1.0, 1.0, 1.0], rtol=1e-6)


def test_only_the_last_five_scenes_count(situation: Make) -> None:
    scenes = [situation([LANE], [vehicle(1, 20.0, mps=float(t))]) for t in range(9)]
    assert speeds_of_first(encode_all(scenes)) == [8.0, 7.0, 6.0, 5.0, 4.0]


def two_vehicles(situation: Make, speeds: tuple[float, float], near: int) -> Situations:
    """Vehicles 1 and 2 with their speeds; `near` is the more critical one."""
    return situation(
        [LANE],
        [
            vehicle(i, 10.0 if i == near else 20.0, mps=v)
            for i, v in zip((1, 2), speeds, strict=True)
        ],
    )


def test_vehicles_that_swap_slots_keep_their_own_history(situation: Make) -> None:
    scenes = [
        two_vehicles(situation, (1.0, 11.0), near=2),
        two_vehicles(situation, (2.0, 12.0), near=2),
        two_vehicles(situation, (3.0, 13.0), near=1),
    ]
    assert speeds_of_first(encode_all(scenes)) == [3.0, 2.0, 1.0, 1.0, 1.0]
    stacked = encode_all(scenes, StateConfig(stacked=True))
    assert speeds_of_first(stacked) == [3.0, 12.0, 11.0, 11.0, 11.0]


def test_a_vehicle_beyond_the_fifth_slot_is_remembered_too(situation: Make) -> None:
    far = [vehicle(i, float(i)) for i in range(1, 6)]
    scenes = [
        situation([LANE], [*far, vehicle(6, 30.0, mps=1.0)]),
        situation([LANE], [vehicle(6, 29.0, mps=2.0)]),
    ]
    assert speeds_of_first(encode_all(scenes)) == [2.0, 1.0, 1.0, 1.0, 1.0]


def test_lanes_that_swap_slots_keep_their_own_history(situation: Make) -> None:
    def scene(first_m: float, second_m: float) -> Situations:
        lanes = [
            {"id": 1, "ego_m": 10.0, "hidden_m": first_m, "limit_mps": 3.0},
            {"id": 2, "ego_m": 10.0, "hidden_m": second_m, "limit_mps": 6.0},
        ]
        return situation(lanes)

    state = encode_all([scene(20.0, 30.0), scene(21.0, 7.0)])
    np.testing.assert_allclose(state[:, 1, 6] * 15.0, [6.0] * 5, rtol=1e-6)
    np.testing.assert_allclose(state[:, 0, 6] ** 2 * 70.0, [7.0, 30.0, 30.0, 30.0, 30.0], rtol=1e-6)


def test_a_vehicle_out_of_sight_is_bridged_by_its_next_later_value(situation: Make) -> None:
    seen = [situation([LANE], [vehicle(1, 20.0, mps=float(t))]) for t in range(1, 6)]
    scenes = [seen[0], seen[1], situation([LANE]), situation([LANE]), seen[4]]
    assert speeds_of_first(encode_all(scenes)) == [5.0, 5.0, 5.0, 2.0, 1.0]


def test_history_belongs_to_a_vehicle_on_a_lane(situation: Make) -> None:
    lanes = [LANE, {"id": 4, "ego_m": 17.5}]
    scenes = [
        situation(lanes, [vehicle(1, 20.0, lane=4, mps=1.0)]),
        situation(lanes, [vehicle(1, 19.0, lane=3, mps=2.0)]),
    ]
    assert speeds_of_first(encode_all(scenes)) == [2.0] * 5


@pytest.mark.parametrize("stacked", [False, True])
def test_a_restart_forgets_one_row_and_no_other(random_situations: Make, stacked: bool) -> None:
    encoder = StateEncoder(StateConfig(stacked=stacked))
    other = StateEncoder(StateConfig(stacked=stacked))
    for i in range(3):
        s = random_situations(seed=i, batch=2)
        encoder.encode(s, np.zeros(2, dtype=bool))
        kept = other.encode(s, np.zeros(2, dtype=bool))
    s = random_situations(seed=9, batch=2)
    state, kept = encoder.encode(s, np.array([True, False])), other.encode(s, np.zeros(2, bool))
    np.testing.assert_array_equal(state[0], np.repeat(state[0, :1], 5, axis=0))
    np.testing.assert_array_equal(state[1], kept[1])
    assert not np.array_equal(kept[0], state[0])


def rows(s: Situations, i: int) -> Situations:
    return Situations._make(field[i : i + 1] for field in s)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_a_row_of_a_batch_is_a_batch_of_one(
    random_situations: Make, seed: int, stacked: bool
) -> None:
    rng = np.random.default_rng(seed)
    config = StateConfig(stacked=stacked)
    whole, alone = StateEncoder(config), [StateEncoder(config) for _ in range(3)]
    for _ in range(7):
        s, restart = random_situations(int(rng.integers(2**31)), 3), rng.random(3) < 0.2
        state = whole.encode(s, restart)
        assert np.all(np.abs(state) <= 1.0)
        for i in range(3):
            one = alone[i].encode(rows(s, i), restart[i : i + 1])
            np.testing.assert_array_equal(one[0], state[i])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_the_order_of_vehicles_changes_nothing(random_situations: Make, seed: int) -> None:
    rng = np.random.default_rng(seed)
    plain, mixed = StateEncoder(), StateEncoder()
    for _ in range(6):
        s, order = random_situations(int(rng.integers(2**31)), 2), rng.permutation(8)
        names = [name for name in s._fields if name.startswith("vehicle_")]
        other = s._replace(**{name: getattr(s, name)[:, order].copy() for name in names})
        restart = np.zeros(2, dtype=bool)
        np.testing.assert_array_equal(plain.encode(s, restart), mixed.encode(other, restart))


def test_room_grows_with_the_traffic_and_loses_nothing(situation: Make) -> None:
    def scene(count: int, t: float) -> Situations:
        return situation([LANE], [vehicle(i, 5.0 + i, mps=t) for i in range(count)])

    state = encode_all([scene(n, float(n)) for n in (1, 4, 9, 30)])
    assert speeds_of_first(state) == [30.0 / 2.0, 9.0, 4.0, 1.0, 1.0]


def test_a_given_array_is_filled(random_situations: Make) -> None:
    s, restart = random_situations(seed=1, batch=2), np.ones(2, dtype=bool)
    out = np.full((2, 5, 3, 8), np.nan, dtype=np.float32)
    assert StateEncoder().encode(s, restart, out) is out
    np.testing.assert_array_equal(out, StateEncoder().encode(s, restart))


def test_a_batch_must_keep_its_size(random_situations: Make) -> None:
    encoder = StateEncoder()
    encoder.encode(random_situations(seed=1, batch=2), np.ones(2, dtype=bool))
    with pytest.raises(InputError, match="3 situations, expected 2"):
        encoder.encode(random_situations(seed=1, batch=3), np.zeros(3, dtype=bool))
    encoder.encode(random_situations(seed=1, batch=3), np.ones(3, dtype=bool))


def test_arrays_of_wrong_shape_are_refused(random_situations: Make) -> None:
    s = random_situations(seed=1, batch=2)
    with pytest.raises(InputError, match="expected"):
        StateEncoder().encode(s, np.ones(1, dtype=bool))
    with pytest.raises(InputError, match="expected"):
        StateEncoder().encode(s, np.ones(2, dtype=bool), np.empty((2, 3, 8), dtype=np.float32))


def test_an_array_with_gaps_is_refused(random_situations: Make) -> None:
    s = random_situations(seed=1, batch=2)
    every_second = np.empty((4, 5, 3, 8), dtype=np.float32)[::2]
    with pytest.raises(InputError, match="without gaps"):
        StateEncoder().encode(s, np.ones(2, dtype=bool), every_second)
