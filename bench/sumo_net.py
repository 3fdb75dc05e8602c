# SPDX-License-Identifier: Apache-2.0
"""A four-way crossing as a SUMO network: a road with priority, and one that has to give way.

Arms are counted from the east, counter-clockwise; arms 0 and 2 have priority. Each has one lane in
and one lane out. A movement is a pair of arms, from which and to which.
"""

import itertools
import math
from collections.abc import Iterator
from xml.etree import ElementTree as ET

ARMS = 4
LENGTH_M = 100.0
JUNCTION_M = 8.0
LANE_OFFSET_M = 1.75
SPEED_MPS = 7.0
TURNS = {1: "r", 2: "s", 3: "l"}

Movement = tuple[int, int]
Point = tuple[float, float]

MOVEMENTS: tuple[Movement, ...] = tuple(
    (source, (source + turn) % ARMS) for source in range(ARMS) for turn in TURNS
)


def crosses(one: Movement, other: Movement) -> bool:
    """Tell whether two movements meet: they end in the same lane, or their ways cross.

    Counter-clockwise about the junction, each arm's lane out comes first, then its lane in; two
    chords cross where one's ends lie on both sides of the other.
    """
    if one[0] == other[0]:
        return False
    if one[1] == other[1]:
        return True
    low, high = sorted((2 * one[0] + 1, 2 * one[1]))
    return (low < 2 * other[0] + 1 < high) != (low < 2 * other[1] < high)


def yields(one: Movement, other: Movement) -> bool:
    """Tell whether the first has to give way to the second where they meet."""
    return crosses(one, other) and _rank(one) < _rank(other)


def _rank(movement: Movement) -> tuple[bool, int, int]:
    """Priority road before the other, straight on before right before left, then any order."""
    source, target = movement
    return source % 2 == 0, "lrs".index(TURNS[(target - source) % ARMS]), -source


def _point(arm: int, distance_m: float, side: int) -> Point:
    """Return a point of an arm's lane in (side 1) or out (side -1)."""
    x, y = ((1, 0), (0, 1), (-1, 0), (0, -1))[arm]
    offset_m = side * LANE_OFFSET_M
    return distance_m * x - offset_m * y, distance_m * y + offset_m * x


def _lane(parent: ET.Element, name: str, points: list[Point]) -> None:
    length_m = sum(math.dist(a, b) for a, b in itertools.pairwise(points))
    shape = " ".join(f"{x:.2f},{y:.2f}" for x, y in points)
    ET.SubElement(
        parent, "lane", id=name, index="0", speed=str(SPEED_MPS), length=f"{length_m:.2f}",
        shape=shape,
    )  # fmt: skip


def _edges() -> Iterator[ET.Element]:
    for k, (source, target) in enumerate(MOVEMENTS):
        edge = ET.Element("edge", id=f":c_{k}", function="internal")
        ends = [_point(source, JUNCTION_M, 1), _point(target, JUNCTION_M, -1)]
        _lane(edge, f":c_{k}_0", ends)
        yield edge
    for arm in range(ARMS):
        priority = "2" if arm % 2 == 0 else "1"
        edge = ET.Element("edge", {"id": f"in{arm}", "from": f"n{arm}", "to": "c"})
        edge.set("priority", priority)
        _lane(edge, f"in{arm}_0", [_point(arm, LENGTH_M, 1), _point(arm, JUNCTION_M, 1)])
        yield edge
        edge = ET.Element("edge", {"id": f"out{arm}", "from": "c", "to": f"n{arm}"})
        edge.set("priority", priority)
        _lane(edge, f"out{arm}_0", [_point(arm, JUNCTION_M, -1), _point(arm, LENGTH_M, -1)])
        yield edge


def _junctions() -> Iterator[ET.Element]:
    corners = [_point(arm, JUNCTION_M, side * 2) for arm in range(ARMS) for side in (-1, 1)]
    middle = ET.Element(
        "junction", id="c", type="priority", x="0", y="0",
        incLanes=" ".join(f"in{arm}_0" for arm in range(ARMS)),
        intLanes=" ".join(f":c_{k}_0" for k in range(len(MOVEMENTS))),
        shape=" ".join(f"{x:.2f},{y:.2f}" for x, y in corners),
    )  # fmt: skip
    for k, movement in enumerate(MOVEMENTS):
        # The last character stands for the first movement.
        others = MOVEMENTS[::-1]
        response = "".join(str(int(yields(movement, other))) for other in others)
        foes = "".join(str(int(crosses(movement, other))) for other in others)
        ET.SubElement(
            middle, "request", index=str(k), response=response, foes=foes, cont="0"
        )  # fmt: skip
    yield middle
    for arm in range(ARMS):
        x, y = _point(arm, LENGTH_M, 0)
        yield ET.Element(
            "junction", id=f"n{arm}", type="dead_end", x=f"{x:.2f}", y=f"{y:.2f}",
            incLanes=f"out{arm}_0", intLanes="", shape=f"{x:.2f},{y:.2f}",
        )  # fmt: skip


def _connections() -> Iterator[ET.Element]:
    for k, (source, target) in enumerate(MOVEMENTS):
        gives_way = any(yields(MOVEMENTS[k], other) for other in MOVEMENTS)
        common = {"to": f"out{target}", "fromLane": "0", "toLane": "0"}
        turn = TURNS[(target - source) % ARMS]
        first = {"from": f"in{source}", **common, "via": f":c_{k}_0", "dir": turn}
        yield ET.Element("connection", {**first, "state": "m" if gives_way else "M"})
        yield ET.Element(
            "connection", {"from": f":c_{k}", **common, "dir": turn, "state": "M"}
        )  # fmt: skip


def network() -> str:
    """Return the network as XML, what netconvert would make of such a crossing."""
    net = ET.Element("net", version="1.20")
    boundary = f"{-LENGTH_M},{-LENGTH_M},{LENGTH_M},{LENGTH_M}"
    ET.SubElement(
        net, "location", netOffset="0.00,0.00", convBoundary=boundary, origBoundary=boundary,
        projParameter="!",
    )  # fmt: skip
    net.extend([*_edges(), *_junctions(), *_connections()])
    return ET.tostring(net, encoding="unicode")


def routes() -> str:
    """Return a type of vehicle and a route for each movement as XML."""
    document = ET.Element("routes")
    ET.SubElement(
        document, "vType", id="car", carFollowModel="IDM", length="4", width="2", accel="2",
    )  # fmt: skip
    for source, target in MOVEMENTS:
        ET.SubElement(
            document, "route", id=f"r{source}{target}", edges=f"in{source} out{target}"
        )  # fmt: skip
    return ET.tostring(document, encoding="unicode")
