# SPDX-License-Identifier: Apache-2.0
"""Kernels that count no references must not be handed arrays that somebody made for them.

Nobody would free these: the code would be right, and leak.
"""

import importlib
import pkgutil
import typing
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

import risk_dqn_planner
import sim_bridge
from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.situations import Floats


def kernels() -> Iterator[Any]:
    """Yield everything that `compiled` compiled, but for what needs ROS."""
    for package in (risk_dqn_planner, sim_bridge):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if ".ros" not in found.name and not found.name.endswith("__main__"):
                module = importlib.import_module(found.name)
                for value in vars(module).values():
                    if getattr(value, "__module__", "") == found.name and is_kernel(value):
                        yield value


def is_kernel(value: object) -> bool:
    return hasattr(value, "py_func") and hasattr(value, "targetoptions")


def counts(compiled: Any) -> bool:  # noqa: ANN401 (numba's dispatcher)
    return bool(compiled.targetoptions.get("_nrt", True))


def holds_arrays(kind: Any) -> bool:  # noqa: ANN401 (any annotation)
    """Whether values of a type are or contain arrays."""
    if np.ndarray in (kind, typing.get_origin(kind)):
        return True
    if isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields"):
        return any(map(holds_arrays, typing.get_type_hints(kind).values()))
    return any(map(holds_arrays, typing.get_args(kind)))


def makes_arrays(compiled: Any) -> bool:  # noqa: ANN401 (numba's dispatcher)
    return holds_arrays(typing.get_type_hints(compiled.py_func).get("return"))


def called_by(compiled: Any) -> list[Any]:  # noqa: ANN401 (numba's dispatcher)
    function = compiled.py_func
    named = (function.__globals__.get(name) for name in function.__code__.co_names)
    return [value for value in named if is_kernel(value)]


def test_who_counts_no_references_makes_no_arrays_and_is_handed_none() -> None:
    found = list(kernels())
    countless = [each for each in found if not counts(each)]
    assert len(countless) > 150
    assert any(makes_arrays(each) for each in found)
    assert [each.__name__ for each in countless if makes_arrays(each)] == []
    handed = [(each, made) for each in countless for made in called_by(each) if makes_arrays(made)]
    assert [(each.__name__, made.__name__) for each, made in handed] == []


class Pair(NamedTuple):
    first: Floats
    second: Floats


@kernel
def larger(pair: Pair, at: int) -> float:
    best = -np.inf
    for k in range(at, len(pair.first)):
        if pair.first[k] > best:
            best = pair.first[k]
        elif pair.second[k] > best:
            return best
    return best


@kernel
def sum_of_larger(pair: Pair) -> float:
    total = 0.0
    for at in range(len(pair.first)):
        if pair.first[at] == 0.0:
            continue
        found = larger(pair, at)
        if found < 0.0:
            break
        total += found
    return total


def test_kernels_count_no_references() -> None:
    compiled: Any = sum_of_larger
    assert compiled(Pair(np.array([1.0, 0.0, 2.0]), np.array([3.0, 5.0, 1.0]))) == 3.0
    (code,) = compiled.inspect_llvm().values()
    assert "NRT_incref" not in code
