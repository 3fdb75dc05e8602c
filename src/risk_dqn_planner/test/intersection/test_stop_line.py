# SPDX-License-Identifier: Apache-2.0
"""The ego drives along x = 0 from y = -80, the first zone is that of a lane along y = 0.

The zone begins at s = 77 m. A line at y makes the ego's centre rest at s = 78 + y: that is
-(y + 1) before the zone.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.intersection.model import IntersectionModel

Sketch = Any
Sketches = Callable[..., Sketch]
ZONE_START_M = 77.0


def crossing(sketch: Sketches) -> tuple[Sketch, Any, Any]:
    drawn = sketch()
    approach = drawn.lane(1, [(0, -80), (0, -10)])
    drawn.lane(2, [(0, -10), (0, 10)])
    drawn.lane(3, [(0, 10), (0, 80)])
    other = drawn.lane(5, [(-80, 0), (80, 0)], speed_limit="30")
    return drawn, approach, other


def build(drawn: Sketch, folder: Path) -> IntersectionModel:
    return build_intersection(drawn.load(folder), [1, 2, 3])


def across(y: float) -> list[tuple[float, float]]:
    return [(-1.6, y), (1.6, y)]


def test_the_ego_rests_half_its_length_before_the_line(sketch: Sketches, tmp_path: Path) -> None:
    drawn, _, _ = crossing(sketch)
    drawn.line(90, across(-6.0), "stop_line")
    model = build(drawn, tmp_path)
    assert model.stop_line.lanelet2_id == 90
    assert not model.stop_line.derived
    assert model.stop_line.position_m == pytest.approx(80.0 - 6.0 - 2.0, abs=1e-3)
    assert model.notes == ()


def test_without_a_line_the_place_is_derived_from_the_first_zone_and_marked(
    sketch: Sketches, tmp_path: Path
) -> None:
    model = build(crossing(sketch)[0], tmp_path)
    assert model.stop_line.derived
    assert model.stop_line.lanelet2_id is None
    assert model.stop_line.position_m == pytest.approx(ZONE_START_M - 2.5, abs=1e-3)
    assert any("no stop line that fits" in note for note in model.notes)


@pytest.mark.parametrize(
    ("y", "reason"),
    [
        (0.5, "stand 1.5 m inside or past the first conflict zone"),
        (-17.0, "stand 16.0 m before the first conflict zone, farther than 15 m"),
    ],
)
def test_a_line_in_the_wrong_place_is_refused_by_name(
    sketch: Sketches, tmp_path: Path, y: float, reason: str
) -> None:
    drawn, approach, other = crossing(sketch)
    line = drawn.line(90, across(y), "stop_line")
    drawn.right_of_way(70, approach, other, line, listed=True)
    model = build(drawn, tmp_path)
    assert model.stop_line.derived
    assert f"stop line 90 is not used: the ego would {reason}" in model.notes


def test_of_several_lines_that_fit_the_nearest_to_the_zone_is_taken(
    sketch: Sketches, tmp_path: Path
) -> None:
    drawn, _, _ = crossing(sketch)
    for line_id, y in ((90, -14.0), (91, -5.0), (92, -9.0), (93, 0.0)):
        drawn.line(line_id, across(y), "stop_line")
    assert build(drawn, tmp_path).stop_line.lanelet2_id == 91


@pytest.mark.parametrize("listed", [True, False])
def test_a_virtual_line_counts_if_a_right_of_way_refers_to_it(
    sketch: Sketches, tmp_path: Path, listed: bool
) -> None:
    drawn, approach, other = crossing(sketch)
    drawn.right_of_way(70, approach, other, drawn.line(90, across(-6.0), "virtual"), listed=listed)
    assert build(drawn, tmp_path).stop_line.lanelet2_id == 90


def test_a_virtual_line_that_nothing_refers_to_is_ignored(sketch: Sketches, tmp_path: Path) -> None:
    drawn, _, _ = crossing(sketch)
    drawn.line(90, across(-6.0), "virtual")
    assert build(drawn, tmp_path).stop_line.derived


def test_a_line_that_a_rule_refers_to_but_that_lies_elsewhere_is_replaced_by_the_true_one(
    sketch: Sketches, tmp_path: Path
) -> None:
    drawn, approach, other = crossing(sketch)
    drawn.right_of_way(
        70, approach, other, drawn.line(90, [(20, 5), (20, 9)], "stop_line"), listed=True
    )
    drawn.line(91, across(-6.0), "stop_line")
    model = build(drawn, tmp_path)
    assert model.stop_line.lanelet2_id == 91
    assert "stop line 90 is not used: it does not cross the ego's path" in model.notes


def test_a_line_for_others_to_yield_at_is_not_the_egos(sketch: Sketches, tmp_path: Path) -> None:
    drawn, _, other = crossing(sketch)
    elsewhere = drawn.lane(8, [(40, -40), (40, -20)])
    drawn.right_of_way(70, elsewhere, other, drawn.line(90, across(-6.0), "virtual"), listed=True)
    assert build(drawn, tmp_path).stop_line.derived


def test_goal_lies_beyond_the_last_zone(sketch: Sketches, tmp_path: Path) -> None:
    model = build(crossing(sketch)[0], tmp_path)
    assert model.goal_m == pytest.approx(83.0 + 17.0, abs=1e-3)


def test_goal_beyond_the_end_of_the_map_is_moved_there_and_noted(
    sketch: Sketches, tmp_path: Path
) -> None:
    drawn, _, _ = crossing(sketch)
    config = IntersectionConfig(goal_beyond_m=100.0)
    model = build_intersection(drawn.load(tmp_path), [1, 2, 3], config)
    assert model.goal_m == pytest.approx(160.0, abs=1e-3)
    assert any("the map ends 77.0 m past the last conflict zone" in note for note in model.notes)


def test_path_is_extended_beyond_a_short_route(sketch: Sketches, tmp_path: Path) -> None:
    drawn, _, _ = crossing(sketch)
    model = build_intersection(drawn.load(tmp_path), [2])
    assert model.route == (2,)
    assert model.ego_path.lanelet_ids == (1, 2, 3)
    assert model.ego_path.lanelet_starts_m == pytest.approx((0.0, 70.0, 90.0), abs=1e-3)
