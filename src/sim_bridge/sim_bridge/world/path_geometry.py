# SPDX-License-Identifier: Apache-2.0
"""Centrelines as the simulator needs them: evenly sampled, simplified, compared with another."""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.geometry.polyline import Polyline, pose_kernel, project_kernel
from risk_dqn_planner.situation.situations import Floats

# Between the samples of a line: chords are off the curve by 5 mm at a radius of 6 m.
SPACING_M = 0.5
# Lines closer than this, in about the same direction, are one lane.
SAME_LINE_M = 0.15
SAME_HEADING_RAD = 0.2
_COMPARE_EVERY_M = 0.25


@kernel
def table_pose(tables: Floats, line: int, s: float) -> tuple[float, float, float]:
    """Return (x, y, heading) at arc length s of one of the sampled lines (P, K, 3).

    Straight on beyond the ends. Headings are continuous, not cut to one turn.
    """
    place = s * (1.0 / SPACING_M)
    k = min(max(int(place), 0), tables.shape[1] - 2)
    share = place - k
    inside = min(max(share, 0.0), 1.0)
    x, y, heading = tables[line, k, 0], tables[line, k, 1], tables[line, k, 2]
    return (
        x + share * (tables[line, k + 1, 0] - x),
        y + share * (tables[line, k + 1, 1] - y),
        heading + inside * (tables[line, k + 1, 2] - heading),
    )


@kernel
def place_ahead(tables: Floats, line: int, s: float, ahead_m: float) -> tuple[float, float]:
    """Return (x, y) so far straight ahead of where `table_pose` is."""
    x, y, heading = table_pose(tables, line, s)
    if ahead_m != 0.0:
        x += ahead_m * math.cos(heading)
        y += ahead_m * math.sin(heading)
    return x, y


def sampled(line: Polyline, count: int) -> Floats:
    """Return x, y, heading (count, 3) every SPACING_M, straight on beyond the line's end."""
    at = np.arange(count) * SPACING_M
    xy = np.array([line.position(s) for s in at])
    # The direction from half a step before to half a step after smooths the line's corners.
    ahead = np.array([line.position(s + 0.5 * SPACING_M) for s in at])
    behind = np.array([line.position(s - 0.5 * SPACING_M) for s in at])
    step = ahead - behind
    return np.column_stack((xy, np.unwrap(np.arctan2(step[:, 1], step[:, 0]))))


def cut(line: Polyline, begin_m: float, end_m: float) -> Polyline:
    """Return the part of a line between two arc lengths, as far as it reaches."""
    begin, end = max(begin_m, 0.0), min(end_m, line.length_m)
    inside = line.xy[(line.s > begin) & (line.s < end)]
    return Polyline.from_points([line.position(begin), *inside, line.position(end)])


def simplified(xy: Floats, tolerance_m: float) -> list[int]:
    """Return which points of a line (K, 2) to keep so that it moves by no more than a tolerance.

    Douglas and Peucker 1973.
    """
    kept = {0, len(xy) - 1}
    pieces = [(0, len(xy) - 1)]
    while pieces:
        begin, end = pieces.pop()
        if end - begin < 2:
            continue
        chord = xy[end] - xy[begin]
        between = xy[begin + 1 : end] - xy[begin]
        square = max(float(chord @ chord), 1e-12)
        share = np.clip(between @ chord / square, 0.0, 1.0)
        away = np.linalg.norm(between - share[:, None] * chord, axis=1)
        worst = int(np.argmax(away))
        if away[worst] > tolerance_m:
            middle = begin + 1 + worst
            kept.add(middle)
            pieces += [(begin, middle), (middle, end)]
    return sorted(kept)


class Shared(NamedTuple):
    """Where line q runs on line p: for s in [low_m, high_m] on q it is at s + offset_m on p.

    near_until_m: how far beyond high_m line q stays within a given distance of p.
    """

    low_m: float
    high_m: float
    offset_m: float
    near_until_m: float


def shared_stretch(p: Polyline, q: Polyline, near_m: float) -> Shared | None:
    """Return the longest stretch that two lines have in common, None if there is none."""
    at = np.append(np.arange(0.0, q.length_m, _COMPARE_EVERY_M), q.length_m)
    on_p, away, turned = _compared(p.xy, p.s, q.xy, q.s, at)
    same = (away < SAME_LINE_M) & (turned < SAME_HEADING_RAD)
    # A line that comes to the same place a second time is further on by a loop.
    steady = np.abs(np.diff(on_p - at)) < SAME_LINE_M
    joined = same[:-1] & same[1:] & steady
    edges = np.flatnonzero(np.diff(np.concatenate(([0], joined.astype(int), [0]))))
    if len(edges) == 0:
        return None
    runs = edges.reshape(-1, 2)
    begin, end = runs[np.argmax(at[runs[:, 1]] - at[runs[:, 0]])]
    until = end
    while until + 1 < len(at) and away[until + 1] < near_m:
        until += 1
    middle = (begin + end) // 2
    offset = on_p[middle] - at[middle]
    return Shared(float(at[begin]), float(at[end]), float(offset), float(at[until]))


@allocating_kernel
def _compared(
    p_xy: Floats, p_s: Floats, q_xy: Floats, q_s: Floats, at: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return for points of q its arc length on p, distance from p and turn against p (A,)."""
    on_p, away, turned = np.empty(len(at)), np.full(len(at), np.inf), np.empty(len(at))
    for k in range(len(at)):
        x, y, heading = pose_kernel(q_xy, q_s, at[k])
        s, lateral, along = project_kernel(p_xy, p_s, x, y, heading, 0.5 * math.pi)
        turn = heading - along
        on_p[k] = s
        turned[k] = abs(math.atan2(math.sin(turn), math.cos(turn)))
        if s > -SAME_LINE_M and s < p_s[-1] + SAME_LINE_M and turned[k] < 0.5 * math.pi:
            away[k] = abs(lateral)
    return on_p, away, turned
