# SPDX-License-Identifier: Apache-2.0
"""Where hidden vehicles may be, remembered from look to look (docs/hidden_space.md).

For each path a set of distances to the zone's centre, between the zone's exit and the end of what
can be seen of the path; beyond that end hidden vehicles may be anywhere at any time. A vehicle
that is hidden now was hidden before, or seen, or has come from beyond the end. So the set after a
look is: what the set before has grown to, the places that lost vehicles may have reached, and what
may have come from beyond, as far as all that is hidden now.

One implementation for batches and for one: whoever finds the hidden pieces of a path, with a
polygon on the vehicle or with shadows in the simulator, hands them over as a set.
"""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.intervals import insert, intersect
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers

# Intervals kept for each path, and for what is in the making while a path is updated: all that
# were kept, one from beyond the end, and some for lost vehicles.
INTERVALS = 8
_WORK_INTERVALS = 2 * INTERVALS
# Growth is rounded up by this.
_ROUNDING_M = 1e-6

NEVER = -math.inf


class HiddenSpace(NamedTuple):
    """The memory of B episodes (one on the vehicle) with P paths and room for N seen vehicles.

    near_m, far_m (B * P, K + 1): row b * P + p holds the set of path p, see `intervals`;
    held (B * P,): how many intervals it has. time_s (B,): of the last look, `NEVER` before the
    first. The (vehicle, lane) pairs seen at the last look, all (B, N): seen_id, seen_lane,
    seen_distance_m; seen (B,): how many.
    """

    near_m: Floats
    far_m: Floats
    held: Integers
    time_s: Floats
    seen: Integers
    seen_id: Integers
    seen_lane: Integers
    seen_distance_m: Floats


class HiddenWork(NamedTuple):
    """What is in the making while the sets of one episode are updated.

    hidden_near_m, hidden_far_m (P, W + 1) and hidden (P,): the sets of what is hidden now.
    grown_near_m, grown_far_m (1, W + 1): where hidden vehicles may have got to. Lost vehicles, all
    (N,): lost_lane, lost_near_m, lost_far_m.
    """

    hidden_near_m: Floats
    hidden_far_m: Floats
    hidden: Integers
    grown_near_m: Floats
    grown_far_m: Floats
    lost_lane: Integers
    lost_near_m: Floats
    lost_far_m: Floats


def empty_hidden_space(batch: int, paths: int, vehicles: int) -> HiddenSpace:
    """Return the memory of those who have not looked yet."""
    rows, pairs = (batch * paths, INTERVALS + 1), (batch, vehicles)
    return HiddenSpace(
        near_m=np.zeros(rows),
        far_m=np.zeros(rows),
        held=np.zeros(batch * paths, dtype=np.int64),
        time_s=np.full(batch, NEVER),
        seen=np.zeros(batch, dtype=np.int64),
        seen_id=np.zeros(pairs, dtype=np.int64),
        seen_lane=np.zeros(pairs, dtype=np.int64),
        seen_distance_m=np.zeros(pairs),
    )


def hidden_work(paths: int, vehicles: int) -> HiddenWork:
    """Return memory to work in for so many paths and up to so many seen vehicles."""
    width = _WORK_INTERVALS + 1
    return HiddenWork(
        hidden_near_m=np.zeros((paths, width)),
        hidden_far_m=np.zeros((paths, width)),
        hidden=np.zeros(paths, dtype=np.int64),
        grown_near_m=np.zeros((1, width)),
        grown_far_m=np.zeros((1, width)),
        lost_lane=np.zeros(vehicles, dtype=np.int64),
        lost_near_m=np.zeros(vehicles),
        lost_far_m=np.zeros(vehicles),
    )


def forget(space: HiddenSpace, mask: Booleans) -> None:
    """Start anew where a mask (B,) says so: whatever is hidden may hold a vehicle again."""
    space.time_s[mask] = NEVER
    space.seen[mask] = 0


@kernel
def elapsed_since(space_time_s: float, time_s: float) -> float:
    """Return the time since the last look; infinity if there was none, or if time went back."""
    elapsed = time_s - space_time_s
    return elapsed if elapsed >= 0.0 else math.inf


@kernel
def still_seen(id_: int, guess: int, mask: Booleans, ids: Integers, b: int) -> bool:
    """Tell whether an id is among the pairs (B, N) of row b, which are packed at the front.

    guess: the place to look at first.
    """
    places = ids.shape[1]
    for step in range(places):
        k = guess + step if guess + step < places else guess + step - places
        if ids[b, k] == id_ and mask[b, k]:
            return True
    return False


@kernel
def find_lost(
    seen: Integers,
    seen_id: Integers,
    seen_lane: Integers,
    seen_distance_m: Floats,
    b: int,
    mask: Booleans,
    ids: Integers,
    elapsed_s: float,
    fastest_mps: Floats,
    slowest_mps: float,
    margin_m: float,
    lost_lane: Integers,
    lost_near_m: Floats,
    lost_far_m: Floats,
) -> int:
    """Fill in where vehicles that are no longer seen may have got to; return how many pairs.

    seen, ...: of HiddenSpace; mask, ids (B, N): the pairs seen now; fastest_mps (M,): of hidden
    vehicles on each lane; margin_m: how far from its place a vehicle may have been; lost_lane, ...:
    of HiddenWork. None after an endless time: then hidden vehicles may be anywhere.
    """
    count = 0
    before = seen[b] if elapsed_s < math.inf else 0
    for k in range(before):
        if still_seen(seen_id[b, k], k, mask, ids, b):
            continue
        lane, distance = seen_lane[b, k], seen_distance_m[b, k]
        lost_lane[count] = lane
        lost_near_m[count] = distance - fastest_mps[lane] * elapsed_s - margin_m
        lost_far_m[count] = distance - slowest_mps * elapsed_s + margin_m
        count += 1
    return count


@kernel
def carry_on(
    near_m: Floats,
    far_m: Floats,
    held: Integers,
    b: int,
    lane_of: Integers,
    exit_m: Floats,
    end_m: Floats,
    elapsed_s: float,
    fastest_mps: Floats,
    slowest_mps: float,
    lost_lane: Integers,
    lost_near_m: Floats,
    lost_far_m: Floats,
    lost: int,
    hidden_near_m: Floats,
    hidden_far_m: Floats,
    hidden: Integers,
    grown_near_m: Floats,
    grown_far_m: Floats,
    nearest_m: Floats,
) -> None:
    """Bring the sets of episode b to the present; lower nearest_m (B, M) to their places.

    near_m, far_m, held: of HiddenSpace. lane_of (P,): index into the M lanes; exit_m, end_m (P,):
    distances between which paths are looked at, the zone's exit and the end; fastest_mps (M,).
    lost: pairs in lost_lane, ...; these and what is hidden now are of HiddenWork.
    """
    paths = len(lane_of)
    for p in range(paths):
        row, lane, end = b * paths + p, lane_of[p], end_m[p]
        if hidden[p] == 0:
            held[row] = 0
            continue
        count = _grow(
            near_m,
            far_m,
            held[row],
            row,
            exit_m[p],
            end,
            elapsed_s,
            fastest_mps[lane],
            slowest_mps,
            grown_near_m,
            grown_far_m,
        )
        for k in range(lost):
            low, high = max(lost_near_m[k], exit_m[p]), min(lost_far_m[k], end)
            if lost_lane[k] == lane and low <= high:
                count = insert(grown_near_m, grown_far_m, 0, count, low, high)
        held[row] = intersect(
            grown_near_m,
            grown_far_m,
            0,
            count,
            hidden_near_m,
            hidden_far_m,
            p,
            hidden[p],
            near_m,
            far_m,
            row,
        )
        if held[row] > 0:
            nearest_m[b, lane] = min(nearest_m[b, lane], near_m[row, 0])


@kernel
def _grow(
    near_m: Floats,
    far_m: Floats,
    held: int,
    row: int,
    exit_m: float,
    end_m: float,
    elapsed_s: float,
    fastest_mps: float,
    slowest_mps: float,
    grown_near_m: Floats,
    grown_far_m: Floats,
) -> int:
    """Write where the vehicles of a set may have got to, and those from beyond the end.

    Returns how many intervals. They ascend, but may overlap.
    """
    ahead, behind, before = 0.0, 0.0, held
    if elapsed_s == math.inf:
        ahead, before = math.inf, 0
    elif elapsed_s > 0.0:
        ahead = fastest_mps * elapsed_s + _ROUNDING_M
        behind = max(slowest_mps * elapsed_s - _ROUNDING_M, 0.0)
    count = 0
    for k in range(before):
        high = far_m[row, k] - behind
        if high >= exit_m:
            grown_near_m[0, count] = max(near_m[row, k] - ahead, exit_m)
            grown_far_m[0, count] = high
            count += 1
    grown_near_m[0, count], grown_far_m[0, count] = max(end_m - ahead, exit_m), end_m
    return count + 1


@kernel
def keep_seen(
    seen: Integers,
    seen_id: Integers,
    seen_lane: Integers,
    seen_distance_m: Floats,
    b: int,
    mask: Booleans,
    ids: Integers,
    lane: Integers,
    distance_m: Floats,
) -> None:
    """Remember the pairs (B, N) that are seen; seen, ...: of HiddenSpace."""
    count = 0
    for k in range(mask.shape[1]):
        if mask[b, k]:
            seen_id[b, count] = ids[b, k]
            seen_lane[b, count] = lane[b, k]
            seen_distance_m[b, count] = distance_m[b, k]
            count += 1
    seen[b] = count
