# SPDX-License-Identifier: Apache-2.0
"""Draws the project's own maps: `draw_maps [folder]` writes them as Lanelet2 files.

Every road is straight, 3.5 m a lane, right-hand traffic, and lies about the origin; the ego
comes from the south and gives way. Stop lines lie so that a car of 4 m waits 2.5 m before its
first conflict zone.
"""

import argparse
import math
from collections.abc import Callable, Sequence
from pathlib import Path

from risk_dqn_planner.map.loader import Lanelet
from sim_bridge.maps.drawing import LANE_WIDTH_M, Arm, Drawing, End, Point
from sim_bridge.maps.shipped import maps_folder, shipped_map

SPEED_LIMIT_MPS = 7.0
OUTER_M = 150.0
EAST, NORTH, WEST, SOUTH = 0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi


def four_way() -> Drawing:
    """Two roads at right angles, straight through only: the paper's crossing."""
    drawing = Drawing()
    # The stop line closes the lane: zone 3 m about the crossing lane's middle, 2.5 m, half a car.
    inner = 0.5 * LANE_WIDTH_M + 3.0 + 2.5 - 2.0
    south, north, west, east = (
        Arm(direction, inner, OUTER_M) for direction in (SOUTH, NORTH, WEST, EAST)
    )
    approach = {arm: drawing.arm(arm)[0] for arm in (south, north, west, east)}
    drawing.connect(south.into(), north.out_of())
    drawing.connect(north.into(), south.out_of())
    main = [
        drawing.connect(west.into(), east.out_of()),
        drawing.connect(east.into(), west.out_of()),
    ]
    for arm in (south, north):
        drawing.yield_at(_stop_line(arm), approach[arm], main)
    return _limited(drawing)


def t_junction() -> Drawing:
    """A road that ends at a main road: the ego turns left across one lane into the other."""
    drawing = Drawing()
    south = Arm(SOUTH, 0.5 * LANE_WIDTH_M + 3.0 + 2.5 - 2.0, OUTER_M)
    west, east = (Arm(direction, 8.0, OUTER_M) for direction in (WEST, EAST))
    (approach, _), _, _ = (drawing.arm(arm) for arm in (south, west, east))
    drawing.connect(south.into(), west.out_of())
    drawing.connect(south.into(), east.out_of())
    main = [
        drawing.connect(west.into(), east.out_of()),
        drawing.connect(east.into(), west.out_of()),
        drawing.connect(west.into(), south.out_of()),
        drawing.connect(east.into(), south.out_of()),
    ]
    drawing.yield_at(_stop_line(south), approach, main)
    return _limited(drawing)


def multi_lane() -> Drawing:
    """A main road with two lanes each way, whose left and right turns meet the ego's way."""
    drawing = Drawing()
    inner = 1.5 * LANE_WIDTH_M + 3.0 + 2.5 - 2.0
    south, north = (Arm(direction, inner, OUTER_M) for direction in (SOUTH, NORTH))
    west, east = (Arm(direction, inner, OUTER_M, lanes=2) for direction in (WEST, EAST))
    approach = {arm: drawing.arm(arm)[0] for arm in (south, north, west, east)}
    drawing.connect(south.into(), north.out_of())
    drawing.connect(north.into(), south.out_of())
    through = [
        drawing.connect(start.into(lane), end.out_of(lane))
        for start, end in ((west, east), (east, west))
        for lane in range(2)
    ]
    turns = [
        drawing.connect(east.into(0), south.out_of()),
        drawing.connect(west.into(0), north.out_of()),
        drawing.connect(east.into(1), north.out_of()),
        drawing.connect(west.into(1), south.out_of()),
    ]
    for arm in (south, north):
        drawing.yield_at(_stop_line(arm), approach[arm], [*through, *turns])
    return _limited(drawing)


RING_RADIUS_M = 14.0
# Entries join and exits leave the ring this far beside their arm.
RING_ANGLE = math.radians(30.0)
RING_STEP = math.radians(2.5)
RING_INNER_M = 24.0
# At which of a curve's points an entry's stop line lies.
RING_STOP_POINT = 11


def roundabout() -> Drawing:
    """A ring of one lane with four arms; the ego goes straight on, past one entry."""
    drawing = Drawing()
    arms = [Arm(direction, RING_INNER_M, OUTER_M) for direction in (SOUTH, EAST, NORTH, WEST)]
    for arm in arms:
        drawing.arm(arm)
    entries, past = [], []
    for arm in arms:
        join, leave = arm.direction + RING_ANGLE, arm.direction - RING_ANGLE
        entries.append(drawing.connect(arm.into(), _ring_end(join)))
        past.append(_ring_lane(drawing, leave, join))
        _ring_lane(drawing, join, arm.direction + 0.5 * math.pi - RING_ANGLE)
        drawing.connect(_ring_end(leave), arm.out_of())
    for entry, ring in zip(entries, past, strict=True):
        drawing.yield_at(_across(entry, RING_STOP_POINT), [entry], [ring])
    return _limited(drawing)


def _ring_point(angle: float, radius_m: float) -> Point:
    return radius_m * math.cos(angle), radius_m * math.sin(angle)


def _ring_end(angle: float) -> End:
    """Return the ring's lane at an angle, driven counter-clockwise."""
    left = _ring_point(angle, RING_RADIUS_M - 0.5 * LANE_WIDTH_M)
    right = _ring_point(angle, RING_RADIUS_M + 0.5 * LANE_WIDTH_M)
    return End(left, right, angle + 0.5 * math.pi)


def _ring_lane(drawing: Drawing, start: float, end: float) -> Lanelet:
    """Draw the part of the ring between two angles."""
    steps = round((end - start) / RING_STEP)
    ends = [_ring_end(start + (end - start) * step / steps) for step in range(steps + 1)]
    return drawing.lane([end.left for end in ends], [end.right for end in ends])


def _stop_line(arm: Arm) -> list[Point]:
    """Return the line across an arm's lanes into the junction."""
    return [arm.point(0, arm.inner_m), arm.point(arm.lanes, arm.inner_m)]


def _across(lanelet: Lanelet, index: int) -> list[Point]:
    """Return the line across a lanelet between its borders' points of an index."""
    left, right = lanelet.leftBound[index], lanelet.rightBound[index]
    return [(left.x, left.y), (right.x, right.y)]


def _limited(drawing: Drawing) -> Drawing:
    """Put up the one speed limit that all the maps have."""
    lanelets = sorted(drawing.lanelet_map.laneletLayer, key=lambda lanelet: int(lanelet.id))
    drawing.limit_speed(lanelets, SPEED_LIMIT_MPS)
    return drawing


DRAWINGS: dict[str, Callable[[], Drawing]] = {
    "four_way": four_way,
    "t_junction": t_junction,
    "multi_lane": multi_lane,
    "roundabout": roundabout,
}


def draw_maps(folder: Path) -> list[Path]:
    """Write every map into a folder and return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, draw in DRAWINGS.items():
        path = folder / f"{name}.osm"
        draw().write(path, shipped_map(name).origin)
        paths.append(path)
    return paths


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line: draw the maps into a folder, by default over those in the sources."""
    parser = argparse.ArgumentParser(description="Draw the project's own Lanelet2 maps.")
    parser.add_argument("folder", nargs="?", type=Path, help="default: the sources' own")
    folder = parser.parse_args(arguments).folder or maps_folder()
    for path in draw_maps(folder):
        print(path)


if __name__ == "__main__":
    main()
