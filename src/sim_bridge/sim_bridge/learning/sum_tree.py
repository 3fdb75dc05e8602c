# SPDX-License-Identifier: Apache-2.0
"""A binary tree of sums in one array: draws in proportion to the leaves in O(log n).

Node 1 is the root, node k has children 2k and 2k + 1, leaf i is node i + leaf_count. Sums are
always those of the two children, never adjusted by differences, so no rounding piles up.
"""

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def empty(leaf_count: int) -> Floats:
    """Return a tree of zeros with room for at least `leaf_count` leaves."""
    power = 1
    while power < leaf_count:
        power *= 2
    return np.zeros(2 * power)


def leaves(tree: Floats) -> Floats:
    """Return a view of all leaves, those beyond the ones in use included."""
    return tree[tree.shape[0] // 2 :]


@kernel
def value(tree: Floats, index: int) -> float:
    """Return leaf `index`."""
    leaf: float = tree[index + tree.shape[0] // 2]
    return leaf


@kernel
def assign(tree: Floats, indices: Integers, values: Floats) -> None:
    """Set leaves (K,) to values (K,), the last one where an index repeats."""
    first_leaf = tree.shape[0] // 2
    for k in range(indices.shape[0]):
        node = indices[k] + first_leaf
        tree[node] = values[k]
        node //= 2
        while node >= 1:
            tree[node] = tree[2 * node] + tree[2 * node + 1]
            node //= 2


@kernel
def find(tree: Floats, mass: float) -> int:
    """Return the leaf in which the running sum of the leaves exceeds `mass` in [0, total).

    A leaf of zero is never returned, not even when rounding brings `mass` to the total.
    """
    first_leaf = tree.shape[0] // 2
    node = 1
    while node < first_leaf:
        node *= 2
        if mass >= tree[node] and tree[node + 1] > 0.0:
            mass -= tree[node]
            node += 1
    leaf: int = node - first_leaf
    return leaf
