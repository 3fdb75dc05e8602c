# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.learning import sum_tree
from sim_bridge.learning.config import ReplayConfig
from sim_bridge.learning.replay import PrioritizedReplay, Transitions, empty_transitions

FEATURES = 2


def numbered(first: int, count: int) -> Transitions:
    """Transitions that carry their number in every field."""
    transitions = empty_transitions(count, FEATURES)
    numbers = np.arange(first, first + count)
    for array in transitions:
        array[:] = numbers.reshape(-1, *[1] * (array.ndim - 1))
    return transitions


def filled(config: ReplayConfig, td_errors: list[float], seed: int = 0) -> PrioritizedReplay:
    replay = PrioritizedReplay(config, FEATURES, seed)
    count = len(td_errors)
    replay.add(numbered(0, count))
    replay.update_priorities(np.arange(count), np.array(td_errors, dtype=np.float32))
    return replay


def naive_probabilities(td_errors: list[float], alpha: float, floor: float) -> NDArray[np.float64]:
    """Schaul et al. 2016, eq. (1), written down term by term."""
    powers = [(abs(float(np.float32(error))) + floor) ** alpha for error in td_errors]
    return np.array([power / sum(powers) for power in powers])


errors = st.lists(st.floats(-3.0, 3.0, width=32), min_size=1, max_size=20)


@settings(deadline=None)
@given(td_errors=errors, alpha=st.floats(0.0, 1.0))
def test_probabilities_are_those_of_the_paper(td_errors: list[float], alpha: float) -> None:
    replay = filled(ReplayConfig(capacity=20, alpha=alpha, priority_floor=0.01), td_errors)
    np.testing.assert_allclose(
        replay.probabilities(), naive_probabilities(td_errors, alpha, 0.01), rtol=1e-12
    )


@settings(deadline=None)
@given(td_errors=errors, beta=st.floats(0.0, 1.0), seed=st.integers(0, 1000))
def test_weights_are_those_of_the_paper(td_errors: list[float], beta: float, seed: int) -> None:
    replay = filled(ReplayConfig(capacity=20, alpha=0.6, priority_floor=0.01), td_errors, seed)
    probabilities = naive_probabilities(td_errors, 0.6, 0.01)
    drawn = replay.sample(8, beta)
    raw = [(len(td_errors) * probabilities[i]) ** -beta for i in drawn.indices]
    np.testing.assert_allclose(drawn.weights, np.array(raw) / max(raw), rtol=1e-5)


def test_each_draw_falls_into_its_slice_of_the_total_priority() -> None:
    # Priorities 1, 2, 3, 4 add to 10: four slices of 2.5 hold leaves {0, 1}, {1, 2}, {2, 3}, {3}.
    replay = filled(ReplayConfig(capacity=4, alpha=1.0, priority_floor=1e-12), [1, 2, 3, 4])
    allowed = [{0, 1}, {1, 2}, {2, 3}, {3}]
    for _ in range(200):
        for index, leaves in zip(replay.sample(4, 0.5).indices, allowed, strict=True):
            assert index in leaves


def test_draws_follow_the_probabilities() -> None:
    td_errors = [0.1, 0.5, 1.0, 2.0, 0.0]
    replay = filled(ReplayConfig(capacity=5, alpha=0.7, priority_floor=0.01), td_errors)
    draws = 40_000
    counts = np.zeros(5)
    for _ in range(draws // 8):
        np.add.at(counts, replay.sample(8, 0.4).indices, 1)
    expected = draws * naive_probabilities(td_errors, 0.7, 0.01)
    # 99.9% quantile of chi-square with 4 degrees of freedom; stratified draws stay well below.
    assert float(((counts - expected) ** 2 / expected).sum()) < 18.47


@settings(deadline=None)
@given(
    values=st.lists(st.integers(0, 9), min_size=1, max_size=33).filter(any),
    share=st.floats(0.0, 1.0),
)
def test_tree_finds_the_leaf_of_the_running_sum(values: list[int], share: float) -> None:
    tree = sum_tree.empty(len(values))
    sum_tree.assign(tree, np.arange(len(values)), np.array(values, dtype=np.float64))
    mass = share * sum(values)
    found = sum_tree.find(tree, mass)
    assert values[found] > 0
    if mass < sum(values):
        assert sum(values[:found]) <= mass < sum(values[: found + 1])


def test_sums_stay_exact_however_often_leaves_change() -> None:
    tree = sum_tree.empty(7)
    random = np.random.default_rng(1)
    for _ in range(2000):
        sum_tree.assign(
            tree, random.integers(0, 7, 3), random.random(3) * 10.0 ** random.integers(-8, 8)
        )
    leaves = sum_tree.leaves(tree)
    pairs = leaves.reshape(-1, 2).sum(axis=1)
    assert tree[1] == pairs.reshape(-1, 2).sum(axis=1).sum()


def test_oldest_transitions_give_way() -> None:
    replay = PrioritizedReplay(ReplayConfig(capacity=4), FEATURES, seed=0)
    for first in (0, 3):
        replay.add(numbered(first, 3))
    assert len(replay) == 4
    assert set(replay.sample(64, 0.4).transitions.a_tm1.tolist()) == {2, 3, 4, 5}


def test_new_transitions_get_the_highest_priority_ever_seen() -> None:
    replay = filled(ReplayConfig(capacity=4, alpha=1.0, priority_floor=0.5), [0.5, 7.5])
    replay.update_priorities(np.array([1]), np.array([0.5], dtype=np.float32))
    replay.add(numbered(2, 1))
    np.testing.assert_allclose(replay.probabilities(), [0.1, 0.1, 0.8])


def test_drawn_rows_are_the_stored_transitions() -> None:
    drawn = filled(ReplayConfig(capacity=8), [0.1] * 8).sample(5, 0.4)
    for array in drawn.transitions:
        expected = drawn.indices.reshape(-1, *[1] * (array.ndim - 1))
        rows = np.broadcast_to(expected, array.shape).astype(array.dtype)
        np.testing.assert_array_equal(array, rows)


def test_a_restored_memory_draws_the_same() -> None:
    replay = filled(ReplayConfig(capacity=6), [0.3, 2.0, 0.1, 1.0])
    restored = PrioritizedReplay(ReplayConfig(capacity=6), FEATURES, seed=99)
    restored.load_state_dict(replay.state_dict())
    for one in (replay, restored):
        one.add(numbered(4, 3))
    for _ in range(5):
        first, second = replay.sample(3, 0.4), restored.sample(3, 0.4)
        np.testing.assert_array_equal(first.indices, second.indices)
        np.testing.assert_array_equal(first.weights, second.weights)
        np.testing.assert_array_equal(first.transitions.s_t, second.transitions.s_t)


def test_more_transitions_than_the_capacity_are_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"3 transitions .* capacity of 2"):
        PrioritizedReplay(ReplayConfig(capacity=2), FEATURES, seed=0).add(numbered(0, 3))
