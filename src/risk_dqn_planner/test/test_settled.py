# SPDX-License-Identifier: Apache-2.0
"""A kernel called through `Settled` does what it does when called as it is."""

import copy
import pickle
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.settled import Settled

Floats = NDArray[np.float64]


class Pair(NamedTuple):
    """Two arrays."""

    first: Floats
    second: Floats


@kernel
def weighted(pair: Pair, values: Floats, factor: float) -> float:
    """Return the weighted sum over both, with what `factor` is worth."""
    total = 0.0
    for i in range(len(values)):
        total += values[i] * (pair.first[i] + factor * pair.second[i])
    return total


@pytest.fixture
def pair() -> Pair:
    return Pair(np.array([1.0, 2.0, 3.0]), np.array([10.0, 20.0, 30.0]))


def test_alike_calls_give_what_the_kernel_gives(pair: Pair) -> None:
    settled = Settled(weighted)
    for scale in (1.0, 2.0, 3.0, 4.0):
        values = scale * np.array([1.0, 0.0, 1.0])
        assert settled(pair, values, 0.5) == scale * (1.0 + 5.0 + 3.0 + 15.0)


@pytest.mark.skipif(not hasattr(weighted, "overloads"), reason="nothing is compiled")
def test_the_way_is_settled_by_the_second_alike_call(
    pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def counted(pair: Pair, values: Floats, factor: float) -> float:
        calls.append(factor)
        return weighted(pair, values, factor)

    weighted(pair, np.ones(3), 0.5)
    monkeypatch.setattr(counted, "overloads", weighted.overloads, raising=False)  # type: ignore[attr-defined]
    monkeypatch.setattr(counted, "typeof_pyval", weighted.typeof_pyval, raising=False)  # type: ignore[attr-defined]
    settled = Settled(counted)
    results = [settled(pair, np.ones(3), factor) for factor in (0.0, 1.0, 2.0)]
    assert results == [6.0, 66.0, 126.0]
    assert calls == [0.0]


@pytest.mark.parametrize(
    "other",
    [
        np.array([1, 0, 1]),
        np.array([1.0, 0.0, 1.0], dtype=np.float32),
        np.array([1.0, 9.0, 0.0, 9.0, 1.0, 9.0])[::2],
    ],
    ids=["integers", "float32", "with gaps"],
)
def test_arrays_of_another_kind_are_not_mistaken(pair: Pair, other: Floats) -> None:
    settled = Settled(weighted)
    values = np.array([1.0, 0.0, 1.0])
    for given in (values, values.copy(), other, other, values, values.copy(), other):
        assert settled(pair, given, 0.5) == 24.0


def test_another_tuple_is_not_mistaken(pair: Pair) -> None:
    settled = Settled(weighted)
    whole = Pair(np.array([1, 2, 3]), np.array([10, 20, 30]))  # type: ignore[arg-type]
    for given in (pair, pair, pair, whole, whole, whole, pair):
        assert settled(given, np.array([1.0, 0.0, 1.0]), 0.5) == 24.0


def test_numbers_of_another_type_are_not_mistaken(pair: Pair) -> None:
    settled = Settled(weighted)
    for factor in (0.5, 0.5, 1, 1, np.float32(0.5), 0.5):
        expected = 6.0 + 60.0 * float(factor)
        assert settled(pair, np.ones(3), factor) == expected


def test_a_plain_function_is_called_as_it_is() -> None:
    settled = Settled(lambda a, b: a + b)
    assert [settled(1, 2), settled(3, 4), settled("a", "b")] == [3, 7, "ab"]


def test_it_can_be_copied_and_pickled_after_its_types_are_settled(pair: Pair) -> None:
    settled = Settled(weighted)
    for _ in range(3):
        settled(pair, np.ones(3), 0.5)
    for again in (copy.deepcopy(settled), pickle.loads(pickle.dumps(settled))):  # noqa: S301
        assert [again(pair, np.ones(3), 0.5) for _ in range(3)] == [36.0] * 3
