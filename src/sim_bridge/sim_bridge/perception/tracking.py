# SPDX-License-Identifier: Apache-2.0
"""The memory of simulated egos: the planner's own bookkeeping on what the simulator's sensor sees.

A place on a path counts as seen only if all places beside it are, up to where vehicles may be.
"""

import math

import numpy as np

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.situation.config import TrackingConfig
from risk_dqn_planner.situation.hidden_space import (
    HiddenSpace,
    HiddenWork,
    carry_on,
    elapsed_since,
    empty_hidden_space,
    find_lost,
    forget,
    hidden_work,
    keep_seen,
)
from risk_dqn_planner.situation.intervals import insert
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations
from sim_bridge.perception.perception import View
from sim_bridge.perception.visibility import narrowed
from sim_bridge.world.watched_lines import WatchedLines, watched_lines
from sim_bridge.world.world import World


@kernel
def add_out_of_range(
    xy: Floats,
    distance: Floats,
    slack_m: Floats,
    points: Integers,
    x: float,
    y: float,
    range_m: float,
    near: Floats,
    far: Floats,
    hidden: Integers,
) -> None:
    """Write where paths are out of range of (x, y), as sets of distances.

    xy, distance, slack_m, points: of WatchedLines; near, far, hidden: of HiddenWork. What is
    nearer to the edge than the path's slack counts as beyond.
    """
    for p in range(len(points)):
        count = 0
        ax, ay = xy[p, 0, 0] - x, xy[p, 0, 1] - y
        for k in range(1, points[p]):
            bx, by = xy[p, k, 0] - x, xy[p, k, 1] - y
            reach = range_m - slack_m[p, k - 1]
            start, end = ax * ax + ay * ay - reach * reach, bx * bx + by * by - reach * reach
            # A disc has no dents: with both ends in it a segment is seen as a whole.
            if start > 0.0 or end > 0.0:
                low, step = distance[p, k - 1], distance[p, k] - distance[p, k - 1]
                enter, leave = _within_reach(ax, ay, bx - ax, by - ay, start)
                if leave <= enter:
                    count = insert(near, far, p, count, low, low + step)
                else:
                    if enter > 0.0:
                        count = insert(near, far, p, count, low, low + enter * step)
                    if leave < 1.0:
                        count = insert(near, far, p, count, low + leave * step, low + step)
            ax, ay = bx, by
        hidden[p] = count


@kernel
def _within_reach(ax: float, ay: float, dx: float, dy: float, start: float) -> tuple[float, float]:
    """Return the shares of the way a + t d between which it lies in a disc; none: twice 1.

    a is relative to the disc's centre, `start` its square less that of the radius.
    """
    square, half = dx * dx + dy * dy, ax * dx + ay * dy
    root = half * half - square * start
    if root <= 0.0:
        return 1.0, 1.0
    enter, leave = (-half - math.sqrt(root)) / square, (-half + math.sqrt(root)) / square
    return min(max(enter, 0.0), 1.0), min(max(leave, 0.0), 1.0)


@kernel
def _plane(shadows: Floats, b: int, o: int, row: int) -> tuple[float, float, float, float]:
    """Return a half-plane of a shadow and the length of its normal."""
    nx, ny = shadows[b, o, row, 0], shadows[b, o, row, 1]
    return nx, ny, shadows[b, o, row, 2], math.sqrt(nx * nx + ny * ny)


@kernel
def add_shadow(
    xy: Floats,
    distance: Floats,
    slack_m: Floats,
    points: Integers,
    shadows: Floats,
    b: int,
    o: int,
    near: Floats,
    far: Floats,
    hidden: Integers,
) -> None:
    """Add to the sets where paths are in shadow o, or nearer to it than their slack.

    Arrays as in `add_out_of_range`. Each half-plane is moved outwards by the slack, the rest is as
    in `first_in_shadow`.
    """
    nx0, ny0, c0, l0 = _plane(shadows, b, o, 0)
    nx1, ny1, c1, l1 = _plane(shadows, b, o, 1)
    nx2, ny2, c2, l2 = _plane(shadows, b, o, 2)
    nx3, ny3, c3, l3 = _plane(shadows, b, o, 3)
    for p in range(len(points)):
        x, y = xy[p, 0, 0], xy[p, 0, 1]
        a0, a1 = nx0 * x + ny0 * y - c0, nx1 * x + ny1 * y - c1
        a2, a3 = nx2 * x + ny2 * y - c2, nx3 * x + ny3 * y - c3
        for k in range(1, points[p]):
            x, y, slack = xy[p, k, 0], xy[p, k, 1], slack_m[p, k - 1]
            z0, z1 = nx0 * x + ny0 * y - c0, nx1 * x + ny1 * y - c1
            z2, z3 = nx2 * x + ny2 * y - c2, nx3 * x + ny3 * y - c3
            s0, s1, s2, s3 = slack * l0, slack * l1, slack * l2, slack * l3
            apart = (max(a0, z0) + s0 <= 0.0) | (max(a1, z1) + s1 <= 0.0)
            apart |= (max(a2, z2) + s2 <= 0.0) | (max(a3, z3) + s3 <= 0.0)
            if not apart:
                enter, leave = narrowed(0.0, 1.0, a0 + s0, z0 + s0)
                enter, leave = narrowed(enter, leave, a1 + s1, z1 + s1)
                enter, leave = narrowed(enter, leave, a2 + s2, z2 + s2)
                enter, leave = narrowed(enter, leave, a3 + s3, z3 + s3)
                if enter < leave:
                    low, step = distance[p, k - 1], distance[p, k] - distance[p, k - 1]
                    low, high = low + enter * step, low + leave * step
                    hidden[p] = insert(near, far, p, hidden[p], low, high)
            a0, a1, a2, a3 = z0, z1, z2, z3


@kernel
def track(
    lines: WatchedLines,
    range_m: float,
    step_s: float,
    slowest_mps: float,
    margin_m: float,
    tick: Integers,
    view: View,
    situations: Situations,
    space: HiddenSpace,
    work: HiddenWork,
) -> None:
    """Bring the memories to the present and fill in how near hidden vehicles may be (B, M).

    tick (B,): inner steps done, of `step_s` each. view, situations: of the present.
    """
    xy, distance, points, slack_m = lines.xy, lines.distance_m, lines.points, lines.slack_m
    lane_of, fastest_mps = lines.lane, lines.fastest_mps
    exit_m, end_m = lines.exit_m, lines.end_m
    x_m, y_m, shadows, cast = view.x_m, view.y_m, view.shadows, view.cast
    mask, ids = situations.vehicle_mask, situations.vehicle_id
    vehicle_lane, vehicle_m = situations.vehicle_lane, situations.vehicle_distance_m
    hidden_m, last_s = situations.lane_hidden_distance_m, space.time_s
    near_m, far_m, held = space.near_m, space.far_m, space.held
    seen, seen_id, seen_lane, seen_m = (
        space.seen,
        space.seen_id,
        space.seen_lane,
        space.seen_distance_m,
    )
    near, far, hidden = work.hidden_near_m, work.hidden_far_m, work.hidden
    grown_near, grown_far = work.grown_near_m, work.grown_far_m
    lost_lane, lost_near, lost_far = work.lost_lane, work.lost_near_m, work.lost_far_m
    for b in range(len(x_m)):
        time_s = tick[b] * step_s
        elapsed_s = elapsed_since(last_s[b], time_s)
        last_s[b] = time_s
        lost = find_lost(
            seen,
            seen_id,
            seen_lane,
            seen_m,
            b,
            mask,
            ids,
            elapsed_s,
            fastest_mps,
            slowest_mps,
            margin_m,
            lost_lane,
            lost_near,
            lost_far,
        )
        for lane in range(len(fastest_mps)):
            hidden_m[b, lane] = range_m
        add_out_of_range(xy, distance, slack_m, points, x_m[b], y_m[b], range_m, near, far, hidden)
        for o in range(cast[b]):
            add_shadow(xy, distance, slack_m, points, shadows, b, o, near, far, hidden)
        carry_on(
            near_m,
            far_m,
            held,
            b,
            lane_of,
            exit_m,
            end_m,
            elapsed_s,
            fastest_mps,
            slowest_mps,
            lost_lane,
            lost_near,
            lost_far,
            lost,
            near,
            far,
            hidden,
            grown_near,
            grown_far,
            hidden_m,
        )
        keep_seen(seen, seen_id, seen_lane, seen_m, b, mask, ids, vehicle_lane, vehicle_m)


class Tracker:
    """The memories of all egos of a simulation; to be told of every look and every beginning.

    space: where hidden vehicles may be, all that changes.
    """

    def __init__(
        self, world: World, config: TrackingConfig, range_m: float, batch: int, pairs: int
    ) -> None:
        """Know nothing yet; `pairs` of a vehicle and a lane can be seen at once in an episode."""
        fastest_mps = world.lanes.limit_mps * config.speed_factor
        self.lines = watched_lines(world.sight, world.paths, fastest_mps)
        self.space = empty_hidden_space(batch, len(self.lines.lane), pairs)
        self._config = config
        self._range_m = range_m
        self._work = hidden_work(len(self.lines.lane), pairs)

    def forget(self, mask: Booleans) -> None:
        """Start anew where a mask (B,) says so."""
        forget(self.space, mask)

    def look(self, tick: Integers, step_s: float, view: View, situations: Situations) -> None:
        """Fill in how near hidden vehicles may be, after what is seen now; see `track`."""
        track(
            self.lines,
            self._range_m,
            step_s,
            self._config.min_speed_mps,
            self._config.vehicle_margin_m,
            tick,
            view,
            situations,
            self.space,
            self._work,
        )

    def intervals(self, episode: int = 0) -> list[Floats]:
        """Return the set of each path (P): near and far ends (I, 2) of one episode's intervals."""
        paths = len(self.lines.lane)
        rows = range(episode * paths, (episode + 1) * paths)
        space = self.space
        return [
            np.column_stack((space.near_m[row], space.far_m[row]))[: space.held[row]]
            for row in rows
        ]
