# SPDX-License-Identifier: Apache-2.0
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lanelet2
import pytest
from lanelet2.core import AttributeMap

from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.intersection.speed_limit import parse_speed_limit

Sketches = Callable[..., Any]


@pytest.mark.parametrize(
    ("text", "expected_mps"),
    [
        ("36 km/h", 10.0),
        ("36", 10.0),
        ("36kmh", 10.0),
        ("36.000000000000004", 10.0),
        ("25.2 km/h", 7.0),
        ("10 m/s", 10.0),
        ("7.5 mps", 7.5),
        ("25 mph", 11.176),
        (" 18 KM/H ", 5.0),
        ("de274-18", 5.0),
        ("274-18", 5.0),
    ],
)
def test_limits_are_read_as_maps_write_them(text: str, expected_mps: float) -> None:
    assert parse_speed_limit(text) == pytest.approx(expected_mps, rel=1e-9)


@pytest.mark.parametrize("text", ["", "fast", "30 knots", "-30", "0 km/h", "de205", "30 40"])
def test_what_is_no_limit_is_not_guessed(text: str) -> None:
    assert parse_speed_limit(text) is None


def model_with(
    sketch: Sketches, folder: Path, config: IntersectionConfig | None = None, **tags: dict[str, str]
) -> IntersectionModel:
    """Ego 1 > 2 > 3 northwards; lane far > near > across from the west, with these tags."""
    drawn = sketch()
    for lane_id, y in ((1, -80), (2, -10), (3, 10)):
        drawn.lane(lane_id, [(0, y), (0, {1: -10, 2: 10, 3: 80}[lane_id])])
    for lane_id, name, start, end in (
        (4, "far", -200, -100), (5, "near", -100, -15), (6, "across", -15, 15)
    ):  # fmt: skip
        drawn.lane(lane_id, [(start, 0), (end, 0)], **tags.get(name, {}))
    return build_intersection(drawn.load(folder), [1, 2, 3], config)


def test_the_highest_limit_on_the_lane_and_upstream_of_it_counts(
    sketch: Sketches, tmp_path: Path
) -> None:
    model = model_with(
        sketch, tmp_path, across={"speed_limit": "18 km/h"}, near={"speed_limit": "36 km/h"}
    )
    assert model.lanes[0].speed_limit_mps == pytest.approx(10.0)
    assert not [note for note in model.notes if "speed limit" in note]


def test_limits_beyond_the_sensor_range_do_not_count(sketch: Sketches, tmp_path: Path) -> None:
    model = model_with(
        sketch, tmp_path, across={"speed_limit": "18 km/h"}, far={"speed_limit": "72 km/h"}
    )
    assert model.lanes[0].paths[0].path.lanelet_ids == (5, 6)
    assert model.lanes[0].speed_limit_mps == pytest.approx(5.0)


def test_without_a_limit_on_the_map_the_default_is_taken_and_noted(
    sketch: Sketches, tmp_path: Path
) -> None:
    model = model_with(sketch, tmp_path, IntersectionConfig(default_speed_limit_mps=6.5))
    assert model.lanes[0].speed_limit_mps == 6.5
    assert "the map has no speed limit for lane 6, 6.5 m/s is assumed" in model.notes


def test_a_limit_that_cannot_be_read_is_named(sketch: Sketches, tmp_path: Path) -> None:
    model = model_with(sketch, tmp_path, across={"speed_limit": "walking"})
    assert model.lanes[0].speed_limit_mps == 7.0
    assert "speed limit 'walking' of lanelet 6 cannot be read" in model.notes


def test_a_sign_counts_instead_of_the_lanelets_attribute(sketch: Sketches, tmp_path: Path) -> None:
    drawn = sketch()
    drawn.lane(1, [(0, -80), (0, 80)])
    across = drawn.lane(6, [(-100, 0), (100, 0)], speed_limit="50 km/h")
    signs = lanelet2.core.TrafficSignsWithType([], "18 km/h")  # type: ignore[attr-defined]
    rule = lanelet2.core.SpeedLimit(70, AttributeMap({"sign_type": "18 km/h"}), signs)
    rule.attributes["subtype"] = "speed_limit"
    across.addRegulatoryElement(rule)
    drawn.lanelet_map.add(rule)
    model = build_intersection(drawn.load(tmp_path), [1])
    assert model.lanes[0].speed_limit_mps == pytest.approx(5.0)
