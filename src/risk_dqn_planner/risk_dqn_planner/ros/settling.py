# SPDX-License-Identifier: Apache-2.0
"""Spares a node the pauses of the garbage collector."""

import gc


def settle() -> None:
    """Collect what is garbage now, and exempt the rest from later collections.

    A policy, a map and their libraries come to more than 100 000 objects that stay. Looking at all
    of them takes some 0.1 s, and without this that pause would come in the middle of some decision.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()
