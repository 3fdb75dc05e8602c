# SPDX-License-Identifier: Apache-2.0
"""Calls of a kernel that are the same but for their numbers, without asking for types each time.

Numba looks at every array of every argument to find the machine code that fits, which for the
nested tuples of a simulation takes longer than the work of a batch of one. Whoever calls with the
same tuples again and again needs that only once.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

_INT64 = np.iinfo(np.int64)


class Settled:
    """One caller's way to a kernel.

    Types are settled by the second of two calls that are alike: each argument is the same object,
    an array of the same kind, or a plain number of the same type. All other calls go the long way.
    Every caller needs one of its own: what different callers give is seldom alike.
    """

    def __init__(self, kernel: Callable[..., Any]) -> None:
        self._kernel = kernel
        # Without the compiler a kernel is a function, and has nothing to choose from.
        self._compiled = hasattr(kernel, "overloads")
        self._last: tuple[Any, ...] = ()
        self._code: Callable[..., Any] | None = None

    def __reduce__(self) -> tuple[type["Settled"], tuple[Callable[..., Any]]]:
        """Copy and pickle the way alone: machine code stays where it is, and is found again."""
        return Settled, (self._kernel,)

    def __call__(self, *arguments: Any) -> Any:  # noqa: ANN401 (whatever the kernel takes)
        """Call the kernel."""
        last = self._last
        if len(last) == len(arguments) and all(map(_alike, arguments, last)):
            if self._code is None and self._compiled:
                self._code = self._find(arguments)
            if self._code is not None:
                return self._code(*arguments)
        else:
            self._last, self._code = arguments, None
        return self._kernel(*arguments)

    def _find(self, arguments: tuple[Any, ...]) -> Callable[..., Any] | None:
        """Return the machine code that an earlier call with such arguments has left behind."""
        kernel: Any = self._kernel
        compiled = kernel.overloads.get(tuple(map(kernel.typeof_pyval, arguments)))
        code: Callable[..., Any] | None = None if compiled is None else compiled.entry_point
        return code


def _alike(new: object, old: object) -> bool:
    """Tell whether two arguments certainly have the same type for the compiler."""
    if new is old:
        return True
    if type(new) is not type(old):
        return False
    if isinstance(new, np.ndarray) and isinstance(old, np.ndarray):
        return new.dtype == old.dtype and new.ndim == old.ndim and new.flags.num == old.flags.num
    if isinstance(new, int):
        return bool(_INT64.min <= new <= _INT64.max)
    return isinstance(new, float)
