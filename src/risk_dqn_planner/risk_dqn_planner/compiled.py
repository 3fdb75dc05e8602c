# SPDX-License-Identifier: Apache-2.0
"""Typed wrappers of numba: the core's arithmetic is compiled once and cached on disk.

A function is written for scalars or small loops, in plain Python. `kernel` compiles it,
`elementwise` also lets it broadcast over arrays of any shape. Both can be called from
other kernels, so batches (training) and a batch of one (vehicle) run the same code.
`NUMBA_DISABLE_JIT=1` runs kernels as plain Python, for a debugger.
"""

from collections import namedtuple
from collections.abc import Callable
from dataclasses import fields
from functools import lru_cache
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile a function; division by zero follows IEEE 754 as in numpy."""
    return cast(Function, numba.njit(cache=True, error_model="numpy")(function))


def elementwise(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of scalars into one that broadcasts like a numpy ufunc."""
    return cast(Callable[..., Any], numba.vectorize(cache=True)(function))


@lru_cache(maxsize=None)
def _record_type(config_type: type) -> Any:
    return namedtuple(f"{config_type.__name__}Record", [f.name for f in fields(config_type)])


def record(config: Any) -> Any:
    """Turn a frozen dataclass of numbers into a named tuple that kernels accept."""
    values = (getattr(config, field.name) for field in fields(config))
    return _record_type(type(config))(*values)
