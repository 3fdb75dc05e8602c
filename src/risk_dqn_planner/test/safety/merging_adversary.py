# SPDX-License-Identifier: Apache-2.0
"""The adversary at a merging lane, after which a crossing lane follows.

Vehicles on the merging lane do what they like, but for what is assumed of followers: once the
ego has been in their lane and both in sight for the reaction time, they brake as hard as it takes
to come to rest behind an ego that brakes. Places are relative to the join. The ego's delay and
rates are up to the adversary, within their ranges.
"""

from typing import NamedTuple

import numpy as np
from adversary import EXACT, EgoMotion, EgoRanges, within

from risk_dqn_planner.policies.constant import ConstantPolicy
from risk_dqn_planner.policies.supervised import Supervisor
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.situation.situations import Floats, Integers, Situations, empty_situations

VEHICLES, PERIODS, SUBSTEPS = 4, 30, 10
STEP_S, PERIOD_S, LIMIT_MPS, REACTION_S, LENGTH_M = 0.05, 0.5, 7.0, 1.0, 4.0
DOWN, FAST_MPS, SLOW_MPS = 3.5, 5.0, 1.0
OTHERS_UP, GENTLE_MPS2, HARDEST_MPS2 = 2.0, 2.0, 8.0
# Followers stop at least this far behind.
KEPT_M = 0.3


class Merges(NamedTuple):
    """R worlds. ego_m, ego_mps (R,); zones end at the join: zone_l_m, lane_l_m (R,).

    seen_m (R,): how far upstream of its zone's centre the lane is seen. blocked_m (R,): centre of
    a crossing zone of 6 m in which someone stands for ever, infinity for none. start_m, start_mps
    (R, V); drives (R, T, V): accelerations from -8 to 2; proposes (R, T). late, hard (R, T): as in
    `adversary.Worlds`.
    """

    ego_m: Floats
    ego_mps: Floats
    zone_l_m: Floats
    lane_l_m: Floats
    seen_m: Floats
    blocked_m: Floats
    start_m: Floats
    start_mps: Floats
    drives: Floats
    proposes: Integers
    late: Floats
    hard: Floats


def draw(rng: np.random.Generator, rows: int, *, brave: bool, ranges: EgoRanges = EXACT) -> Merges:
    """Draw worlds whose ego can still stop before the zone, once the first decision is in force."""
    zone_l_m, mps = rng.uniform(3.0, 8.0, rows), rng.uniform(0.0, 4.9, rows)
    stops_m = ranges.delay_s[1] * mps + 0.5 * mps * mps / DOWN
    size = (rows, PERIODS)
    blocked = rng.random(rows) < 0.5
    return Merges(
        ego_m=-zone_l_m - stops_m - rng.uniform(0.5, 8.0, rows),
        ego_mps=mps,
        zone_l_m=zone_l_m,
        lane_l_m=rng.uniform(3.0, 8.0, rows),
        seen_m=rng.uniform(0.0, 60.0, rows),
        blocked_m=np.where(blocked, rng.uniform(8.0, 20.0, rows), np.inf),
        start_m=rng.uniform(-60.0, 10.0, (rows, VEHICLES)),
        start_mps=rng.uniform(0.0, LIMIT_MPS, (rows, VEHICLES)),
        drives=rng.choice([-8.0, -2.0, 0.0, 2.0, 2.0], (*size, VEHICLES)),
        proposes=np.full(size, 2) if brave else rng.integers(0, 3, size),
        late=rng.integers(0, 2, size).astype(np.float64),
        hard=rng.integers(0, 2, size).astype(np.float64),
    )


def perceived(w: Merges, ego: Floats, mps: Floats, others: Floats, speeds: Floats) -> Situations:
    """What the ego gets to know."""
    s = empty_situations(len(ego), VEHICLES + 1, 2)
    s.goal_distance_m[:], s.ego_speed_mps[:] = 100.0, mps
    s.lane_mask[:, 0], s.lane_mask[:, 1] = True, np.isfinite(w.blocked_m)
    s.lane_merging[:, 0], s.lane_id[:], s.lane_speed_limit_mps[:] = True, [1, 2], LIMIT_MPS
    s.lane_ego_zone_m[:, 0], s.lane_zone_m[:, 0] = w.zone_l_m, w.lane_l_m
    s.lane_ego_zone_m[:, 1], s.lane_zone_m[:, 1] = 6.0, 6.0
    s.lane_ego_distance_m[:, 0] = -0.5 * w.zone_l_m - ego
    s.lane_ego_distance_m[:, 1] = np.where(s.lane_mask[:, 1], w.blocked_m - ego, 0.0)
    s.lane_hidden_distance_m[:, 0], s.lane_hidden_distance_m[:, 1] = w.seen_m, 60.0
    s.vehicle_id[:] = np.arange(VEHICLES + 1)
    s.vehicle_distance_m[:, :-1] = -0.5 * w.lane_l_m[:, None] - others
    s.vehicle_speed_mps[:, :-1] = speeds
    s.vehicle_mask[:, :-1] = s.vehicle_distance_m[:, :-1] < w.seen_m[:, None]
    s.vehicle_lane[:, -1], s.vehicle_mask[:, -1] = 1, s.lane_mask[:, 1]
    return s


def wanted(free: Floats, gap_m: Floats, mps: Floats, ego_mps: Floats, down: float) -> Floats:
    """The acceleration of followers that have reacted: what they like if it leaves them room.

    down: the ego's hardest braking, for which they are prepared.
    """
    room_m = np.maximum(gap_m - KEPT_M, 1e-3)
    stop = 0.5 * mps * mps / (room_m + 0.5 * ego_mps * ego_mps / down)
    closing = np.maximum(mps - ego_mps, 0.0)
    needed = np.maximum(stop, 0.5 * closing * closing / room_m)
    braking = -np.minimum(np.maximum(needed, GENTLE_MPS2), HARDEST_MPS2)
    return np.where(needed >= 0.8 * GENTLE_MPS2, np.minimum(braking, free), free)


def nearness(w: Merges, supervisor: Supervisor, ranges: EgoRanges = EXACT) -> Floats:
    """Drive all worlds; return the least room between footprints in the lane (R,) [m].

    -1 where the ego has run into the blocked zone.
    """
    rows = len(w.ego_m)
    ego, mps = w.ego_m.copy(), w.ego_mps.copy()
    others, speeds = w.start_m.copy(), w.start_mps.copy()
    before, hardest_mps2 = np.zeros(rows), ranges.down_mps2[1]
    known_s, worst = np.zeros(others.shape), np.full(rows, np.inf)
    for t in range(PERIODS):
        proposals = supervisor.policy
        assert isinstance(proposals, ConstantPolicy)
        s = perceived(w, ego, mps, others, speeds)
        proposals.now = w.proposes[:, t]  # type: ignore[attr-defined]
        action = supervisor.decide(s, np.full(rows, t == 0)).action
        target = np.array([0.0, SLOW_MPS, FAST_MPS])[action]
        late_s, hard = within(ranges.delay_s, w.late[:, t]), w.hard[:, t]
        rates = within(ranges.up_mps2, hard), within(ranges.down_mps2, hard)
        for k in range(SUBSTEPS):
            drive = EgoMotion(np.clip(late_s - k * STEP_S, 0.0, STEP_S), before, target, *rates)
            entered = ego >= -w.zone_l_m
            seen = -0.5 * w.lane_l_m[:, None] - others < w.seen_m[:, None]
            known_s += np.where(entered[:, None] & seen, STEP_S, 0.0)
            gap_m = ego[:, None] - others - LENGTH_M
            follows = (known_s >= REACTION_S - 1e-9) & (gap_m > -LENGTH_M)
            free = w.drives[:, t]
            rate = np.where(follows, wanted(free, gap_m, speeds, mps[:, None], hardest_mps2), free)
            goal = np.where(rate > 0.0, LIMIT_MPS, np.where(rate < 0.0, 0.0, speeds))
            up = np.where(rate > 0.0, rate, OTHERS_UP)
            down = np.where(rate < 0.0, -rate, HARDEST_MPS2)
            others += distance_after(STEP_S, speeds, goal, up, down)
            speeds = speed_after(STEP_S, speeds, goal, up, down)
            moved_m, mps = drive.after(STEP_S, mps)
            ego = ego + moved_m
            outside = np.maximum(-w.zone_l_m[:, None] - ego[:, None], -w.lane_l_m[:, None] - others)
            room = np.abs(ego[:, None] - others) - LENGTH_M
            # Before the zone nothing can happen, and the adversary should not be content.
            worst = np.minimum(worst, np.where(outside < 0.0, room, 10.0 + outside).min(axis=1))
            worst = np.where(ego > w.blocked_m - 3.0, -1.0, worst)
        before = target
    return worst


def bred(rng: np.random.Generator, w: Merges, near: Floats) -> Merges:
    """Return the next generation: the nearest quarter and their changed offspring."""
    rows, best = len(near), np.argsort(near)[: len(near) // 4]
    chosen = np.concatenate((best, rng.choice(best, rows - len(best))))
    child = Merges._make(field[chosen] for field in w)
    new = np.arange(rows) >= len(best)
    for field, spread in ((child.start_m, 4.0), (child.start_mps, 1.0), (child.seen_m, 4.0)):
        changes = rng.normal(0.0, spread, field.shape) * (rng.random(field.shape) < 0.3)
        field[new] += changes[new]
    child.start_mps[:] = np.clip(child.start_mps, 0.0, LIMIT_MPS)
    child.seen_m[:] = np.maximum(child.seen_m, -0.5 * child.lane_l_m)
    shape = child.drives.shape
    fresh = rng.choice([-8.0, -2.0, 0.0, 2.0], shape)
    mutated = (rng.random(shape) < 0.15) & new[:, None, None]
    child.drives[:] = np.where(mutated, fresh, child.drives)
    for share in (child.late, child.hard):
        changed = (rng.random(share.shape) < 0.15) & new[:, None]
        share[:] = np.where(changed, rng.uniform(0.0, 1.0, share.shape), share)
    return child


def search(
    supervisor: Supervisor,
    *,
    seed: int,
    generations: int,
    rows: int = 640,
    brave: bool = True,
    ranges: EgoRanges = EXACT,
) -> float:
    """Return how near the adversary came: below 0 is a collision [m]."""
    rng = np.random.default_rng(seed)
    w = draw(rng, rows, brave=brave, ranges=ranges)
    near = nearness(w, supervisor, ranges)
    for _ in range(generations):
        if near.min() < 0.0:
            break
        w = bred(rng, w, near)
        near = nearness(w, supervisor, ranges)
    return float(near.min())
