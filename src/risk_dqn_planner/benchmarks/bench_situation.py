# SPDX-License-Identifier: Apache-2.0
"""How long the situation node computes on one message: from messages to message.

Objects lie at random on and beside the lanes of a real intersection model; the visible area is a
star of random radii, as a lidar behind obstacles gives. Sending is not timed.
The time is the processor's, so that a busy machine measures the same.

    python src/risk_dqn_planner/benchmarks/bench_situation.py [--map M.osm --route 1,2 --origin A,B]
"""

import argparse
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rclpy.serialization import serialize_message

from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import MapOrigin, load_map
from risk_dqn_planner.ros import conversions
from risk_dqn_planner.situation.inputs import EgoPose, ObjectArrays, object_arrays
from risk_dqn_planner.situation.pipeline import SituationPipeline
from risk_dqn_planner.situation.report import Status

REPOSITORY = Path(__file__).resolve().parents[3]
FOUR_WAY = REPOSITORY / "src/sim_bridge/maps/four_way.osm"
BUDGET_MS = 5.0
BUDGET_OBJECTS = 50
POLYGON_CORNERS = 720
STAMP_NS = 10**9


class Took(NamedTuple):
    """How long an update takes: median, 99th percentile and longest [ms]."""

    p50_ms: float
    p99_ms: float
    max_ms: float


def random_objects(model: IntersectionModel, count: int, rng: np.random.Generator) -> ObjectArrays:
    """Return vehicles, half of them on intersecting lanes, half up to 30 m beside them."""
    paths = [path.path.centerline for lane in model.lanes for path in lane.paths]
    rows = np.empty((count, 4))
    for row in rows:
        line = paths[rng.integers(len(paths))]
        s = rng.uniform(0.0, line.length_m)
        offset = rng.normal(0.0, 0.3) if rng.random() < 0.5 else rng.uniform(-30.0, 30.0)
        (x, y), heading = line.position(s), line.heading_at(s)
        row[:] = (
            x - offset * math.sin(heading),
            y + offset * math.cos(heading),
            heading + rng.normal(0.0, 0.1),
            rng.uniform(0.0, 14.0),
        )
    return object_arrays(rows, size_m=(4.5, 1.8))


def random_area(ego: EgoPose, rng: np.random.Generator) -> np.ndarray:
    """Return a star-shaped polygon about the ego with shadows in it."""
    angles = np.linspace(0.0, 2.0 * math.pi, POLYGON_CORNERS, endpoint=False)
    radii = np.full(POLYGON_CORNERS, 70.0)
    for _ in range(6):
        begin, width = rng.integers(POLYGON_CORNERS), rng.integers(5, 60)
        radii[begin : begin + width] = rng.uniform(15.0, 60.0)
    corners = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    corners += np.array([ego.x_m, ego.y_m])
    return corners


def measure(model: IntersectionModel, count: int, repetitions: int, seed: int) -> np.ndarray:
    """Return the milliseconds of each repetition."""
    rng = np.random.default_rng(seed)
    pipeline = SituationPipeline(lambda _route: model)
    pipeline.select(model.route)
    path = model.ego_path.centerline
    took_ms = np.empty(repetitions)
    for k in range(repetitions):
        s = rng.uniform(0.0, model.goal_m)
        ego = EgoPose(*path.position(s), path.heading_at(s), rng.uniform(0.0, 5.0))
        odometry = conversions.ego_to_message(ego, STAMP_NS)
        area = conversions.area_to_message(random_area(ego, rng), STAMP_NS)
        objects = conversions.objects_to_message(random_objects(model, count, rng), STAMP_NS)
        sent_area, sent_objects = bytes(serialize_message(area)), bytes(serialize_message(objects))
        begin = time.thread_time()
        received = conversions.read_area(sent_area), conversions.read_objects(sent_objects)
        seen = conversions.perception_from_messages(odometry, *received, "map", 0.0)
        report = pipeline.report(STAMP_NS, seen)
        message = conversions.situation_to_message(report)
        took_ms[k] = 1e3 * (time.thread_time() - begin)
        if message.status != Status.OK:
            raise SystemExit(f"the benchmark's own input is refused: {message.status_text}")
    return took_ms


def summary(took_ms: np.ndarray) -> Took:
    """Return what matters of the milliseconds of many repetitions."""
    p50_ms, p99_ms, max_ms = np.percentile(took_ms, [50.0, 99.0, 100.0])
    return Took(float(p50_ms), float(p99_ms), float(max_ms))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table; fail if the median for 50 objects is over the budget."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--map", type=Path, default=FOUR_WAY, help="Lanelet2 map [%(default)s]")
    parser.add_argument("--route", default="1,9,4", help="lanelet ids [%(default)s]")
    parser.add_argument("--origin", default="49.0,8.4", help="latitude,longitude [%(default)s]")
    parser.add_argument("--repetitions", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    road_map = load_map(options.map, MapOrigin.from_text(options.origin))
    model = build_intersection(road_map, [int(part) for part in options.route.split(",")])
    paths = [path for lane in model.lanes for path in lane.paths]
    points = sum(len(path.path.centerline.s) for path in paths)
    print(
        f"{options.map.name}: {len(model.lanes)} lanes, {len(paths)} paths of {points} points, "
        f"visible area of {POLYGON_CORNERS} corners"
    )
    print("objects   p50 [ms]   p99 [ms]   max [ms]")
    measure(model, BUDGET_OBJECTS, 3, options.seed)  # compiles
    within = True
    for count in (0, 10, 50, 200):
        took = summary(measure(model, count, options.repetitions, options.seed))
        print(f"{count:7d} {took.p50_ms:10.2f} {took.p99_ms:10.2f} {took.max_ms:10.2f}")
        within &= count != BUDGET_OBJECTS or took.p50_ms < BUDGET_MS
    return 0 if within else 1


if __name__ == "__main__":
    raise SystemExit(main())
