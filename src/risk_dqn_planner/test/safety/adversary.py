# SPDX-License-Identifier: Apache-2.0
"""A search for traffic that makes an ego collide, in an exact world of crossing lanes.

Everything that the assumptions leave open is up to the adversary: where vehicles begin and how
fast, whether each brakes, keeps its speed or accelerates in every period, the errors of their
measured speeds, where sight ends on each lane (it may also fall back), when within its range a
decision takes effect and how hard the ego then accelerates and brakes, and what the policy inside
the supervisor proposes. Populations of such worlds are bred for nearness to contact.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.policies.base import Decisions
from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.supervised import Supervisor
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.situation.situations import (
    Booleans,
    Floats,
    Integers,
    Situations,
    empty_situations,
)

LANES, VEHICLES, PERIODS, SUBSTEPS = 3, 4, 28, 10
PERIOD_S, LIMIT_MPS = 0.5, 7.0
UP, DOWN, FAST_MPS, SLOW_MPS = 1.5, 3.5, 5.0, 1.0
OTHERS_UP, OTHERS_DOWN = 2.0, 6.0
BRAKES, KEEPS = 0, 1


class Worlds(NamedTuple):
    """R worlds; the ego begins at 0 with its speed, places are ahead of it.

    zone_m, zone_l_m (R, M): centres and lengths of the zones on the ego's path; lane_l_m (R, M):
    lengths along the lanes. near_m, far_m, back_m (R, M): how far a lane is seen before and
    after the ego has come to place turn_m (R,), growing by back_m a metre.
    lane (V,) of the vehicles; start_m, start_mps (R, V); drives (R, T, V): 0 brakes, 1 keeps its
    speed, 2 accelerates; error (R, T, V) in [-1, 1]; proposes (R, T): actions. late, hard (R, T)
    in [0, 1]: when decisions take effect, and how the ego accelerates and brakes, in their ranges.
    """

    ego_mps: Floats
    zone_m: Floats
    zone_l_m: Floats
    lane_l_m: Floats
    near_m: Floats
    far_m: Floats
    turn_m: Floats
    start_m: Floats
    start_mps: Floats
    drives: Integers
    error: Floats
    proposes: Integers
    late: Floats
    hard: Floats


class EgoRanges(NamedTuple):
    """Between which values the ego's delay [s], acceleration and braking [m/s^2] lie."""

    delay_s: tuple[float, float] = (0.0, 0.0)
    up_mps2: tuple[float, float] = (UP, UP)
    down_mps2: tuple[float, float] = (DOWN, DOWN)


EXACT = EgoRanges()


class EgoMotion(NamedTuple):
    """One period: until late_s (R,) for one target (R,), then for another; rates (R,)."""

    late_s: Floats
    before_mps: Floats
    target_mps: Floats
    up: Floats
    down: Floats

    def after(self, time_s: float, mps: Floats) -> tuple[Floats, Floats]:
        """Return the way covered and the speed (R,) after a time."""
        first_s = np.minimum(time_s, self.late_s)
        rest_s = time_s - first_s
        way_m = distance_after(first_s, mps, self.before_mps, self.up, self.down)
        then_mps = speed_after(first_s, mps, self.before_mps, self.up, self.down)
        way_m = way_m + distance_after(rest_s, then_mps, self.target_mps, self.up, self.down)
        return way_m, speed_after(rest_s, then_mps, self.target_mps, self.up, self.down)


def within(bounds: tuple[float, float], share: Floats) -> Floats:
    low, high = bounds
    return low + (high - low) * share


LANE_OF: NDArray[np.int64] = np.arange(VEHICLES) % LANES


class Proposals(ConstantPolicy):
    """Proposes what the world says; `now` (R,) is set before each decision."""

    now: Integers

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        return super().decide(situations, restart)._replace(action=self.now)


def draw(rng: np.random.Generator, groups: int, each: int, *, brave: bool) -> Worlds:
    """Draw worlds in groups that share lanes and sight."""
    rows = groups * each

    def shared(low: float, high: float, *shape: int) -> Floats:
        return np.repeat(rng.uniform(low, high, (groups, *shape)), each, axis=0)

    zone_l_m, gap_m = shared(4.0, 8.0, LANES), shared(-5.0, 6.0, LANES)
    gap_m[:, 0] = shared(5.0, 20.0)
    begins_m = np.cumsum(gap_m, axis=1) + np.cumsum(zone_l_m, axis=1) - zone_l_m
    near_m, far_m = shared(4.0, 60.0, LANES), shared(4.0, 60.0, LANES)
    size = (rows, PERIODS, VEHICLES)
    return Worlds(
        ego_mps=rng.uniform(0.0, 4.9, rows),
        zone_m=begins_m + 0.5 * zone_l_m,
        zone_l_m=zone_l_m,
        lane_l_m=shared(4.0, 8.0, LANES),
        near_m=near_m,
        far_m=far_m,
        turn_m=shared(0.0, 20.0),
        start_m=rng.uniform(5.0, 90.0, (rows, VEHICLES)),
        start_mps=rng.uniform(0.0, LIMIT_MPS, (rows, VEHICLES)),
        drives=rng.integers(0, 3, size),
        error=rng.uniform(-1.0, 1.0, size),
        proposes=np.full(size[:2], 2) if brave else rng.integers(0, 3, size[:2]),
        late=rng.integers(0, 2, size[:2]).astype(np.float64),
        hard=rng.integers(0, 2, size[:2]).astype(np.float64),
    )


def perceived(
    w: Worlds, t: int, ego: Floats, mps: Floats, others: Floats, error: float
) -> Situations:
    """What the ego gets to know: ego (R,) place, mps (R,), others (R, 2, V) places and speeds."""
    rows = len(ego)
    s = empty_situations(rows, VEHICLES, LANES)
    s.goal_distance_m[:], s.ego_speed_mps[:] = 100.0, mps
    s.lane_mask[:], s.lane_id[:], s.lane_speed_limit_mps[:] = True, np.arange(LANES), LIMIT_MPS
    s.lane_ego_distance_m[:] = w.zone_m - ego[:, None]
    s.lane_ego_zone_m[:], s.lane_zone_m[:] = w.zone_l_m, w.lane_l_m
    seen_m = np.where(ego[:, None] < w.turn_m[:, None], w.near_m, w.far_m)
    s.lane_hidden_distance_m[:] = np.maximum(seen_m, -0.5 * w.lane_l_m)
    s.vehicle_id[:], s.vehicle_lane[:] = np.arange(VEHICLES), LANE_OF
    s.vehicle_distance_m[:], s.vehicle_speed_mps[:] = others[:, 0], others[:, 1]
    s.vehicle_speed_mps[:] += error * w.error[:, t]
    s.vehicle_mask[:] = others[:, 0] < s.lane_hidden_distance_m[:, LANE_OF]
    return s


def nearness(
    w: Worlds, supervisor: Supervisor, error_mps: float = 0.0, ranges: EgoRanges = EXACT
) -> Floats:
    """Drive all worlds; return how near each came to contact (R,): below 0 is a collision [m]."""
    rows = len(w.ego_mps)
    ego, mps, worst = np.zeros(rows), w.ego_mps.copy(), np.full(rows, np.inf)
    others = np.stack((w.start_m, w.start_mps), axis=1)
    before = np.zeros(rows)
    proposals = supervisor.policy
    assert isinstance(proposals, Proposals)
    for t in range(PERIODS):
        proposals.now = w.proposes[:, t]
        s = perceived(w, t, ego, mps, others, error_mps)
        action = supervisor.decide(s, np.full(rows, t == 0)).action
        target = np.array([0.0, SLOW_MPS, FAST_MPS])[action]
        late_s, hard = within(ranges.delay_s, w.late[:, t]), w.hard[:, t]
        rates = within(ranges.up_mps2, hard), within(ranges.down_mps2, hard)
        drive = EgoMotion(late_s, before, target, *rates)
        goal = np.where(w.drives[:, t] == BRAKES, 0.0, np.maximum(others[:, 1], LIMIT_MPS))
        goal = np.where(w.drives[:, t] == KEEPS, others[:, 1], goal)
        for k in range(1, SUBSTEPS + 1):
            time_s = PERIOD_S * k / SUBSTEPS
            at_m = w.zone_m - (ego + drive.after(time_s, mps)[0])[:, None]
            way_m = distance_after(time_s, others[:, 1], goal, OTHERS_UP, OTHERS_DOWN)
            apart_m = np.maximum(
                (np.abs(at_m) - 0.5 * w.zone_l_m)[:, LANE_OF],
                np.abs(others[:, 0] - way_m) - 0.5 * w.lane_l_m[:, LANE_OF],
            )
            worst = np.minimum(worst, apart_m.min(axis=1))
        moved_m, mps = drive.after(PERIOD_S, mps)
        ego, before = ego + moved_m, target
        others[:, 0] -= way_m
        others[:, 1] = speed_after(PERIOD_S, others[:, 1], goal, OTHERS_UP, OTHERS_DOWN)
    return worst


def bred(rng: np.random.Generator, w: Worlds, near: Floats, each: int) -> Worlds:
    """Return the next generation: the nearest quarter of each group, and their offspring."""
    rows = len(near)
    order = np.argsort(near.reshape(-1, each), axis=1) + np.arange(0, rows, each)[:, None]
    best = order[:, : each // 4]
    parents = np.take_along_axis(best, rng.integers(0, each // 4, order.shape), axis=1)
    parents[:, : each // 4] = best
    child = Worlds._make(field[parents.ravel()] for field in w)
    changed = np.ones(order.shape, dtype=np.bool_)
    changed[:, : each // 4] = False
    new = changed.ravel()

    def some(shape: tuple[int, ...], share: float) -> Booleans:
        mutated: Booleans = rng.random(shape) < share
        return mutated & new.reshape(-1, *[1] * (len(shape) - 1))

    shape = child.start_m.shape
    child.start_m[:] += np.where(some(shape, 0.4), rng.normal(0.0, 4.0, shape), 0.0)
    child.start_m[:] = np.maximum(child.start_m, 5.0)
    child.start_mps[:] += np.where(some(shape, 0.4), rng.normal(0.0, 1.0, shape), 0.0)
    child.start_mps[:] = np.clip(child.start_mps, 0.0, LIMIT_MPS)
    shape = child.drives.shape
    child.drives[:] = np.where(some(shape, 0.15), rng.integers(0, 3, shape), child.drives)
    child.error[:] = np.where(some(shape, 0.15), rng.uniform(-1.0, 1.0, shape), child.error)
    shape = child.late.shape
    child.late[:] = np.where(some(shape, 0.15), rng.uniform(0.0, 1.0, shape), child.late)
    child.hard[:] = np.where(some(shape, 0.15), rng.uniform(0.0, 1.0, shape), child.hard)
    if not (w.proposes == w.proposes[0, 0]).all():
        shape = child.proposes.shape
        child.proposes[:] = np.where(some(shape, 0.15), rng.integers(0, 3, shape), child.proposes)
    return child


def search(
    supervisor: Supervisor,
    *,
    seed: int,
    generations: int,
    groups: int = 20,
    each: int = 32,
    brave: bool = True,
    error_mps: float = 0.0,
    ranges: EgoRanges = EXACT,
) -> tuple[int, float]:
    """Return in how many groups of worlds a collision was found, and how near it came at all.

    The search ends with the first generation that collides.
    """
    rng = np.random.default_rng(seed)
    w = draw(rng, groups, each, brave=brave)
    near = nearness(w, supervisor, error_mps, ranges)
    for _ in range(generations):
        if near.min() < 0.0:
            break
        w = bred(rng, w, near, each)
        near = nearness(w, supervisor, error_mps, ranges)
    nearest = near.reshape(groups, each).min(axis=1)
    return int((nearest < 0.0).sum()), float(nearest.min())
