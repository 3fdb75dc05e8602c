# SPDX-License-Identifier: Apache-2.0
"""Typed wrappers of numba: the core's arithmetic is compiled once and kept on disk.

A function is written for scalars or small loops, in plain Python. `kernel` compiles it,
`allocating_kernel` where it makes arrays, `elementwise` also lets it broadcast over arrays of
any shape. All can be called from other kernels, so batches (training) and a batch of one
(vehicle) run the same code. `NUMBA_DISABLE_JIT=1` runs kernels as plain Python, for a debugger.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar, cast

import numba

from risk_dqn_planner.compiled_cache import cache_folder

Function = TypeVar("Function", bound=Callable[..., Any])

# Its hints leave out what is used here.
_numba: Any = numba

# Reordering of sums and fused products, but never an assumption that numbers are finite.
_REORDERING = {"reassoc", "contract", "nsz"}


def kernel(function: Function) -> Function:
    """Compile a function that neither makes arrays nor returns any; IEEE 754 as in numpy.

    It counts no references, and kernels that call it take it in whole: with that, most of the time
    went into counting the references of every array of every tuple that was passed on. A kernel
    that makes arrays, copies one into another at once (which may take a third), or calls one that
    returns them, must be an `allocating_kernel`.
    """
    with _cache_of(function):
        compiled = _numba.njit(cache=True, error_model="numpy", forceinline=True, _nrt=False)
        return cast(Function, compiled(function))


def allocating_kernel(function: Function) -> Function:
    """Compile a function like `kernel`, but one that may make and return arrays."""
    with _cache_of(function):
        compiled = _numba.njit(cache=True, error_model="numpy", forceinline=True, _nrt=True)
        return cast(Function, compiled(function))


def reordering_kernel(function: Function) -> Function:
    """Compile a function whose sums may be reordered, so that they run in vector registers."""
    with _cache_of(function):
        compiled = _numba.njit(cache=True, error_model="numpy", fastmath=_REORDERING)(function)
        return cast(Function, compiled)


def elementwise(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of scalars into one that broadcasts like a numpy ufunc."""
    with _cache_of(function):
        return cast(Callable[..., Any], _numba.vectorize(cache=True)(function))


@contextmanager
def _cache_of(function: Callable[..., Any]) -> Iterator[None]:
    """Let numba keep what it compiles in the folder that fits the function's sources."""
    before = _numba.config.CACHE_DIR
    _numba.config.CACHE_DIR = before or cache_folder(function.__module__)
    try:
        yield
    finally:
        _numba.config.CACHE_DIR = before
