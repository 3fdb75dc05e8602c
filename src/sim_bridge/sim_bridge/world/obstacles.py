# SPDX-License-Identifier: Apache-2.0
"""Where obstacles stand: rectangles before the first conflict zone, clear of every lane.

For each side of the ego's lane a catalogue of placements is checked once; an episode only picks
from it. A placement is drawn (size and gaps), turned along the ego's lane, and put as close to
the corner of ego lane and intersecting lanes as its gaps allow: it is moved back along the ego's
lane and away from it by the least sum of both.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from risk_dqn_planner.errors import ScenarioError
from risk_dqn_planner.intersection.model import IntersectionModel, LanePath
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers
from sim_bridge.scenarios.fields import Obstacles

LEFT, RIGHT = 0, 1
_PLACEMENTS = 256
_COARSE_STEP_M = 2.0
_FINE_STEPS_M = (1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125)
_MOST_MOVED_M = 40.0
# Obstacles may reach this far beyond the start of the first conflict zone.
_BEYOND_M = 3.0
_ROUNDING_M = 1e-6
# Roads matter within this radius of the first zone's centre, their outlines to this accuracy.
_NEAR_M = 90.0
_OUTLINE_M = 0.01


class Catalogue(NamedTuple):
    """corners (2, K, 4, 2): rectangles of the left and of the right, counter-clockwise [m].

    available (2,): how many of the K are valid; 0 where a side has no room for any.
    """

    corners: Floats
    available: Integers


class _Roads(NamedTuple):
    """What obstacles keep clear of, as prepared shapely geometries."""

    ego: BaseGeometry
    crossing: BaseGeometry
    other: BaseGeometry


def obstacle_catalogue(
    model: IntersectionModel,
    config: Obstacles,
    world_seed: int,
    keep_out: Sequence[NDArray[np.float64]] = (),
) -> Catalogue:
    """Draw and check the placements of both sides; deterministic for a world seed.

    keep_out: further polygons (K, 2) on which nothing may stand, such as all lanelets near by;
    they are kept clear by the smaller of the two gaps.

    Raises:
        ScenarioError: a side has no room although obstacles are required.
    """
    corners = np.zeros((2, _PLACEMENTS, 4, 2))
    available = np.zeros(2, dtype=np.int64)
    roads = _roads(model, keep_out)
    for side in (LEFT, RIGHT) if config.per_side else ():
        placed = _placements(model, config, roads, side, world_seed)
        available[side] = len(placed)
        corners[side, : len(placed)] = placed
        if config.required and len(placed) == 0:
            name = "left" if side == LEFT else "right"
            raise ScenarioError(
                f"there is no room for an obstacle on the {name} of route {model.route}, "
                "and the scenario's obstacles.required is true"
            )
    return Catalogue(corners, available)


def _corridor(path: LanePath) -> BaseGeometry:
    return LineString(path.centerline.xy).buffer(path.half_width_m, cap_style="flat")


def _roads(model: IntersectionModel, keep_out: Sequence[NDArray[np.float64]]) -> _Roads:
    crossing = [_corridor(path.path) for lane in model.lanes for path in lane.paths]
    first_zone = Point(model.ego_path.centerline.position(model.lanes[0].ego_zone_center_m))
    near = first_zone.buffer(_NEAR_M)
    whole = (
        _corridor(model.ego_path),
        shapely.union_all(crossing),
        shapely.union_all([Polygon(points).buffer(0.0) for points in keep_out]),
    )
    roads = _Roads(*(road.intersection(near).simplify(_OUTLINE_M) for road in whole))
    for road in roads:
        shapely.prepare(road)
    return roads


class _Drawn(NamedTuple):
    """Sizes and gaps [m] of K rectangles, each (K,)."""

    length: Floats
    width: Floats
    gap_ego: Floats
    gap_cross: Floats


def _draw(config: Obstacles, side: int, world_seed: int) -> _Drawn:
    draw = np.random.default_rng((world_seed, side))
    intervals = (config.length_m, config.width_m, config.gap_ego_m, config.gap_cross_m)
    return _Drawn(*(draw.uniform(each.low, each.high, _PLACEMENTS) for each in intervals))


def _placements(
    model: IntersectionModel, config: Obstacles, roads: _Roads, side: int, world_seed: int
) -> Floats:
    """Return the valid rectangles (K, 4, 2) of a side."""
    drawn = _draw(config, side, world_seed)
    start = min(lane.ego_zone_center_m - 0.5 * lane.ego_zone_length_m for lane in model.lanes)

    def try_moves(which: Integers, back: Floats, away: Floats) -> tuple[Floats, Booleans]:
        """Return corners and validity of rectangles `which` moved back and away (W, ...)."""
        of = _Drawn(*(values[which].reshape((-1,) + (1,) * (back.ndim - 1)) for values in drawn))
        inner = of.gap_ego + model.ego_path.half_width_m + away
        corners = _rectangles(model, start + _BEYOND_M - back, inner, of.length, of.width, side)
        return corners, _free(corners, roads, of.gap_ego, of.gap_cross)

    moved, found = _coarse_moves(try_moves)
    which = np.flatnonzero(found)
    if len(which) == 0:
        return np.zeros((0, 4, 2))
    moved = moved[which]
    # Then back towards the corner, as far as the gaps allow.
    for step in _FINE_STEPS_M:
        for axis in (0, 1):
            closer = moved.copy()
            closer[:, axis] = np.maximum(closer[:, axis] - step, 0.0)
            _, free = try_moves(which, closer[:, 0], closer[:, 1])
            moved[free] = closer[free]
    corners, _ = try_moves(which, moved[:, 0], moved[:, 1])
    return corners


def _coarse_moves(
    try_moves: Callable[[Integers, Floats, Floats], tuple[Floats, Booleans]],
) -> tuple[Floats, Booleans]:
    """Return the first moves (K, 2), back and away, that suit each rectangle, and which (K,)."""
    moved = np.zeros((_PLACEMENTS, 2))
    found = np.zeros(_PLACEMENTS, dtype=np.bool_)
    moves = np.arange(0.0, _MOST_MOVED_M + _COARSE_STEP_M, _COARSE_STEP_M)
    for least in range(len(moves)):
        # All ways to split one sum of moves between back and away, for all that are still open.
        still = np.flatnonzero(~found)
        if len(still) == 0:
            break
        back, away = moves[: least + 1][None, :], moves[least::-1][None, :]
        _, free = try_moves(still, back, away)
        suits = free.any(axis=1)
        first = free.argmax(axis=1)[suits]
        moved[still[suits]] = np.column_stack((back[0, first], away[0, first]))
        found[still[suits]] = True
    return moved, found


def _rectangles(
    model: IntersectionModel, front: Floats, inner: Floats, length: Floats, width: Floats, side: int
) -> Floats:
    """Return corners (..., 4, 2) of rectangles that end at ego arc length `front`.

    They lie along the ego's lane at that place, `inner` metres from its centreline.
    """
    front, inner, length, width = np.broadcast_arrays(front, inner, length, width)
    line = model.ego_path.centerline
    places, index = np.unique(front, return_inverse=True)
    # The heading half a length behind the front is that of the lane beside the rectangle.
    middle = places - 0.5 * float(np.mean(length))
    pose = np.array(
        [(*line.position(s), line.heading_at(m)) for s, m in zip(places, middle, strict=True)]
    )[index.reshape(front.shape)]
    ahead = np.stack((np.cos(pose[..., 2]), np.sin(pose[..., 2])), axis=-1)
    left = np.stack((-ahead[..., 1], ahead[..., 0]), axis=-1)
    sign = 1.0 if side == LEFT else -1.0
    near = sign * inner[..., None] * left
    far = sign * (inner + width)[..., None] * left
    behind = -length[..., None] * ahead
    base = pose[..., :2]
    corners = np.stack(
        (base + near, base + far, base + far + behind, base + near + behind), axis=-2
    )
    return corners if side == LEFT else corners[..., ::-1, :]


def _free(corners: Floats, roads: _Roads, gap_ego: Floats, gap_cross: Floats) -> Booleans:
    """Tell which rectangles (..., 4, 2) keep their gaps."""
    boxes = shapely.polygons(corners)
    free = np.ones(boxes.shape, dtype=np.bool_)
    gaps = (gap_ego, gap_cross, np.minimum(gap_ego, gap_cross))
    for road, gap in zip(roads, gaps, strict=True):
        # Real roads have thousands of edges: what one road rules out is not held against the next.
        least = np.broadcast_to(gap - _ROUNDING_M, boxes.shape)[free]
        free[free] = ~shapely.dwithin(road, boxes[free], least)
    return free
