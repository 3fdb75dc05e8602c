# SPDX-License-Identifier: Apache-2.0
"""Whether what is perceived can be true: speeds, sizes, jumps between messages, the visible area.

Everything here raises `InputError` with the kind of the fault and the input it is about. The first
message after `forget` is compared with nothing, so that a new errand may begin anywhere.
"""

import math
from typing import NamedTuple

import numpy as np

from risk_dqn_planner.errors import InputError
from risk_dqn_planner.faults import FaultyInput, Status
from risk_dqn_planner.geometry.polygon import crossing_edges, enclosed_area_kernel
from risk_dqn_planner.situation.inputs import (
    EgoPose,
    ObjectArrays,
    Perception,
    check_ego,
    check_objects,
    check_visible_area,
)
from risk_dqn_planner.situation.limits import PlausibilityLimits
from risk_dqn_planner.situation.matching import turned_by_kernel
from risk_dqn_planner.situation.situations import Floats, Integers

# Corners come as 32-bit numbers, and outlines may touch themselves.
_CROSSING_TOLERANCE_M = 0.1
# An ego this slow need not move, and one that moves so little does not.
_STANDSTILL_MPS = 0.5
_STANDSTILL_M = 0.1
# Headings may go on counting for some turns.
_MAX_HEADING_RAD = 100.0
# Objects that were not seen for so long may be anywhere, and ids may be given anew.
_REMEMBERED_S = 2.0


class _Ego(NamedTuple):
    time_s: float
    pose: EgoPose


class _Seen(NamedTuple):
    """Objects as last seen, all (N,), ordered by id."""

    id: Integers
    time_s: Floats
    x_m: Floats
    y_m: Floats
    speed_mps: Floats


_NOBODY = _Seen(np.empty(0, dtype=np.int64), *(np.empty(0) for _ in range(4)))


class Plausibility:
    """Compares each perception with the limits and with the ones before it."""

    def __init__(self, limits: PlausibilityLimits | None = None) -> None:
        self.limits = limits or PlausibilityLimits()
        self.forget()

    def forget(self) -> None:
        """Compare the next message with none before it."""
        self._ego: _Ego | None = None
        self._moved: _Ego | None = None  # when the ego was last known to move
        self._seen = _NOBODY

    def check(self, seen: Perception, ego_time_s: float, objects_time_s: float) -> None:
        """Look at one perception; its times are the stamps of odometry and objects.

        Raises:
            InputError: the first thing that cannot be true; names it, its kind and its input.
        """
        check_ego(seen.ego)
        check_objects(seen.objects)
        check_visible_area(seen.visible_area)
        self._check_ego(_Ego(ego_time_s, seen.ego))
        self._check_objects(seen.objects, objects_time_s)
        self._check_area(seen.visible_area)
        self._check_distances(seen)

    def check_next_ego(self, ego: EgoPose, time_s: float) -> None:
        """Look at an odometry that is newer than the objects; its time is its stamp.

        Raises:
            InputError: as `check`.
        """
        check_ego(ego)
        self._check_ego(_Ego(time_s, ego))

    def _check_ego(self, now: _Ego) -> None:
        limit_mps, speed_mps = self.limits.max_ego_speed_mps, now.pose.speed_mps
        before, self._ego = self._ego, now
        if abs(speed_mps) > limit_mps:
            text = f"ego: speed_mps is {speed_mps:g}, expected at most {limit_mps:g} in size"
            raise InputError(text, Status.IMPLAUSIBLE_SPEED, FaultyInput.ODOMETRY)
        if before is not None and now.time_s > before.time_s:
            self._check_ego_motion(before, now)
        self._check_ego_moves(now)

    def _check_ego_motion(self, before: _Ego, now: _Ego) -> None:
        limits, dt_s = self.limits, now.time_s - before.time_s
        moved_m = math.hypot(now.pose.x_m - before.pose.x_m, now.pose.y_m - before.pose.y_m)
        fastest_mps = max(abs(now.pose.speed_mps), abs(before.pose.speed_mps))
        allowed_m = limits.ego_jump_m + (fastest_mps + limits.ego_speed_margin_mps) * dt_s
        if moved_m > allowed_m:
            text = (
                f"ego: {moved_m:.1f} m away after {dt_s:.2f} s, expected at most {allowed_m:.1f} m"
            )
            raise InputError(text, Status.IMPLAUSIBLE_JUMP, FaultyInput.ODOMETRY)
        turned = turned_by_kernel(now.pose.heading_rad, before.pose.heading_rad)
        allowed = limits.ego_turn_rad + limits.ego_turn_rate_radps * dt_s
        if turned > allowed:
            text = (
                f"ego: turned by {math.degrees(turned):.0f} degrees in {dt_s:.2f} s, "
                f"expected at most {math.degrees(allowed):.0f}"
            )
            raise InputError(text, Status.IMPLAUSIBLE_JUMP, FaultyInput.ODOMETRY)

    def _check_ego_moves(self, now: _Ego) -> None:
        """Raise InputError if the ego has said to drive, but stood, for too long."""
        since, pose = self._moved, now.pose
        if since is None or now.time_s < since.time_s or abs(pose.speed_mps) < _STANDSTILL_MPS:
            self._moved = now
            return
        if math.hypot(pose.x_m - since.pose.x_m, pose.y_m - since.pose.y_m) > _STANDSTILL_M:
            self._moved = now
            return
        stood_s = now.time_s - since.time_s
        if stood_s >= self.limits.ego_frozen_s:
            text = f"ego: drives at {pose.speed_mps:.1f} m/s, but has not moved for {stood_s:.1f} s"
            raise InputError(text, Status.FROZEN_INPUT, FaultyInput.ODOMETRY)

    def _check_objects(self, objects: ObjectArrays, time_s: float) -> None:
        limits, count = self.limits, len(objects.id)
        before, self._seen = self._seen, self._remember(objects, time_s)
        if count > limits.max_objects:
            text = f"objects: {count} in one list, expected at most {limits.max_objects}"
            raise InputError(text, Status.INVALID_SIZE, FaultyInput.OBJECTS)
        for kind, name, limit in (
            (Status.IMPLAUSIBLE_SPEED, "speed_mps", limits.max_object_speed_mps),
            (Status.INVALID_SIZE, "length_m", limits.max_object_length_m),
            (Status.INVALID_SIZE, "width_m", limits.max_object_width_m),
            (Status.MALFORMED_INPUT, "heading_rad", _MAX_HEADING_RAD),
        ):
            values = getattr(objects, name)
            worst = int(np.argmax(np.abs(values))) if count else -1
            if count and abs(values[worst]) > limit:
                text = (
                    f"object {objects.id[worst]}: {name} is {values[worst]:g}, "
                    f"expected at most {limit:g} in size"
                )
                raise InputError(text, kind, FaultyInput.OBJECTS)
        self._check_object_jumps(before, objects, time_s)

    def _check_object_jumps(self, before: _Seen, objects: ObjectArrays, time_s: float) -> None:
        limits = self.limits
        _, then, now = np.intersect1d(
            before.id, objects.id, assume_unique=True, return_indices=True
        )
        dt_s = time_s - before.time_s[then]
        with np.errstate(over="ignore", invalid="ignore"):  # huge coordinates are far away
            moved_m = np.hypot(
                objects.x_m[now] - before.x_m[then], objects.y_m[now] - before.y_m[then]
            )
        fastest_mps = np.maximum(np.abs(objects.speed_mps[now]), np.abs(before.speed_mps[then]))
        allowed_m = limits.object_jump_m + (fastest_mps + limits.object_speed_margin_mps) * dt_s
        beyond = (moved_m > allowed_m) & (dt_s > 0.0) & (dt_s <= _REMEMBERED_S)
        if beyond.any():
            k = int(np.argmax(beyond))
            text = (
                f"object {objects.id[now[k]]}: {moved_m[k]:.1f} m away after {dt_s[k]:.2f} s, "
                f"expected at most {allowed_m[k]:.1f} m"
            )
            raise InputError(text, Status.IMPLAUSIBLE_JUMP, FaultyInput.OBJECTS)

    def _remember(self, objects: ObjectArrays, time_s: float) -> _Seen:
        """Return everyone as last seen: those of this list, and those lately out of sight."""
        before = self._seen
        age_s = time_s - before.time_s
        kept = (age_s >= 0.0) & (age_s <= _REMEMBERED_S) & ~np.isin(before.id, objects.id)
        times = np.full(len(objects.id), time_s)
        present = (objects.id, times, objects.x_m, objects.y_m, objects.speed_mps)
        pairs = zip(before, present, strict=True)
        joined = [np.concatenate((old[kept], new)) for old, new in pairs]
        order = np.argsort(joined[0], kind="stable")
        return _Seen(*(column[order] for column in joined))

    def _check_distances(self, seen: Perception) -> None:
        """Raise InputError if something is where no sensor of the ego can have seen it.

        If nothing that is visible is near, the ego itself is elsewhere: its route tells of that.
        """
        limit_m, ego = self.limits.max_distance_m, seen.ego
        corners_m = _distances(ego, seen.visible_area[:, 0], seen.visible_area[:, 1])
        if corners_m.min() > limit_m:
            return
        far = int(np.argmax(corners_m))
        if corners_m[far] > limit_m:
            text = f"corner {far} is {corners_m[far]:.3g} m from the ego"
            raise InputError(
                f"visible area: {text}, expected at most {limit_m:g} m",
                Status.INVALID_VISIBLE_AREA,
                FaultyInput.VISIBLE_AREA,
            )
        objects_m = _distances(ego, seen.objects.x_m, seen.objects.y_m)
        if objects_m.max(initial=0.0) > limit_m:
            far = int(np.argmax(objects_m))
            text = f"object {seen.objects.id[far]}: {objects_m[far]:.3g} m from the ego"
            raise InputError(
                f"{text}, expected at most {limit_m:g} m",
                Status.MALFORMED_INPUT,
                FaultyInput.OBJECTS,
            )

    def _check_area(self, corners: Floats) -> None:
        limits, where = self.limits, FaultyInput.VISIBLE_AREA
        kind = Status.INVALID_VISIBLE_AREA
        if len(corners) > limits.max_visible_corners:
            text = f"{len(corners)} corners, expected at most {limits.max_visible_corners}"
            raise InputError(f"visible area: {text}", kind, where)
        corners = np.ascontiguousarray(corners, dtype=np.float64)
        i, j = crossing_edges(corners, _CROSSING_TOLERANCE_M)
        if i >= 0:
            text = f"edges {i} and {j} cross each other, expected a simple polygon"
            raise InputError(f"visible area: {text}", kind, where)
        area_m2 = enclosed_area_kernel(corners)
        # Written so that not-a-number, which huge coordinates lead to, is too small.
        if not area_m2 >= limits.min_visible_area_m2:
            text = f"encloses {area_m2:.3g} m^2, expected at least {limits.min_visible_area_m2:g}"
            raise InputError(f"visible area: {text}", kind, where)


def _distances(ego: EgoPose, x_m: Floats, y_m: Floats) -> Floats:
    """Return how far places (N,) are from the ego [m]; huge coordinates are infinitely far away."""
    with np.errstate(over="ignore"):
        away_m: Floats = np.hypot(x_m - ego.x_m, y_m - ego.y_m)
    return away_m
