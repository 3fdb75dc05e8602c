# SPDX-License-Identifier: Apache-2.0
"""Traffic that moves as vehicles do, so that a node has no reason to doubt it.

The objects are those of the situation's own benchmark: half of them on intersecting lanes, half
beside them, at 0 to 14 m/s. At the end of its lane an object begins again with another id.
"""

import math
from typing import NamedTuple

import bench_situation
import numpy as np
from geometry_msgs.msg import PolygonStamped
from intersection_msgs.msg import PerceivedObjects
from nav_msgs.msg import Odometry
from numpy.typing import NDArray

from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.situation.inputs import EgoPose, ObjectArrays, Perception, object_arrays

SIZE_M = (4.5, 1.8)
TOP_SPEED_MPS = 14.0
EGO_TOP_SPEED_MPS = 5.0
_APPROACH_M = 40.0  # the ego begins so far before its stop line
_SHARE_OF_WAY = 0.9
_BESIDE_M = 30.0
_LANE_NOISE_M = 0.3


class Inputs(NamedTuple):
    """The messages of one moment."""

    odometry: Odometry
    visible_area: PolygonStamped
    objects: PerceivedObjects


def perception(inputs: Inputs) -> Perception:
    """Return what the planner makes of the messages."""
    area = conversions.read_area.of(inputs.visible_area)
    objects = conversions.read_objects.of(inputs.objects)
    return conversions.perception_from_messages(inputs.odometry, area, objects, "map", 0.0)


class _Driver(NamedTuple):
    """One object: where it starts on its line [m], how far left of it it drives [m]."""

    line: Polyline
    start_m: float
    aside_m: float
    speed_mps: float


class MovingScene:
    """Objects and an ego that move on for a while; where they are depends on the time only."""

    def __init__(self, model: IntersectionModel, count: int, duration_s: float, seed: int) -> None:
        """Place `count` objects; the ego takes the duration from before the stop line to its goal.

        It drives at 5 m/s at most, and stays short of its goal.
        """
        self._rng = np.random.default_rng(seed)
        self._model = model
        self._start_m = max(0.0, model.stop_line.position_m - _APPROACH_M)
        way_m = _SHARE_OF_WAY * (model.goal_m - self._start_m)
        self._ego_mps = min(EGO_TOP_SPEED_MPS, way_m / duration_s)
        lines = [path.path.centerline for lane in model.lanes for path in lane.paths]
        self._drivers = [self._driver(lines, k) for k in range(count)]

    def _driver(self, lines: list[Polyline], number: int) -> _Driver:
        line = lines[self._rng.integers(len(lines))]
        beside = number % 2 == 1
        aside_m = (
            self._rng.uniform(-_BESIDE_M, _BESIDE_M)
            if beside
            else self._rng.normal(0.0, _LANE_NOISE_M)
        )
        start_m = self._rng.uniform(0.0, line.length_m)
        return _Driver(line, start_m, aside_m, self._rng.uniform(0.0, TOP_SPEED_MPS))

    def ego(self, time_s: float) -> EgoPose:
        """Pose of the ego's centre."""
        line = self._model.ego_path.centerline
        s = self._start_m + self._ego_mps * time_s
        return EgoPose(*line.position(s), line.heading_at(s), self._ego_mps)

    def objects(self, time_s: float) -> ObjectArrays:
        """All objects: on a lane they follow it, beside it they drive straight on."""
        rows, ids = np.empty((len(self._drivers), 4)), []
        for number, (row, driver) in enumerate(zip(rows, self._drivers, strict=True)):
            line = driver.line
            laps, s = divmod(driver.start_m + driver.speed_mps * time_s, line.length_m)
            ids.append(number + 1 + int(laps) * len(self._drivers))
            row[:] = (*self._place(driver, number % 2 == 1, s), driver.speed_mps)
        return object_arrays(rows, ids, size_m=SIZE_M)

    @staticmethod
    def _place(driver: _Driver, beside: bool, s: float) -> tuple[float, float, float]:
        base_m = 0.0 if beside else s
        (x, y), heading = driver.line.position(base_m), driver.line.heading_at(base_m)
        ahead_m = s if beside else 0.0
        return (
            x + ahead_m * math.cos(heading) - driver.aside_m * math.sin(heading),
            y + ahead_m * math.sin(heading) + driver.aside_m * math.cos(heading),
            heading,
        )

    def area(self, ego: EgoPose) -> NDArray[np.float64]:
        """Return a visible area with shadows in it, another one each time."""
        return bench_situation.random_area(ego, self._rng)

    def inputs(self, time_s: float, stamp_ns: int) -> Inputs:
        """Return all messages of a moment."""
        ego = self.ego(time_s)
        return Inputs(
            conversions.ego_to_message(ego, stamp_ns),
            conversions.area_to_message(self.area(ego), stamp_ns),
            conversions.objects_to_message(self.objects(time_s), stamp_ns),
        )
