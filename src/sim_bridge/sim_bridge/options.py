# SPDX-License-Identifier: Apache-2.0
"""Numbers on command lines: one out of range is refused with its option and the range."""

import argparse
from collections.abc import Callable

# Messages and the simulator hold seeds in 64 bits.
LARGEST_SEED = 2**63 - 1


def whole_number(low: int, high: int = LARGEST_SEED) -> Callable[[str], int]:
    """Return the `type` of an option that takes whole numbers from `low` to `high`."""

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"{text!r} is out of range, expected a whole number from {low} to {high}"
            )
        return value

    return read


def number(low: float, high: float) -> Callable[[str], float]:
    """Return the `type` of an option that takes numbers from `low` to `high`."""

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"{text!r} is out of range, expected a number from {low:g} to {high:g}"
            )
        return value

    return read
