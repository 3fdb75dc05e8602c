# SPDX-License-Identifier: Apache-2.0
from collections.abc import Callable

import numpy as np
import pytest
import shapely

from risk_dqn_planner.errors import ScenarioError
from risk_dqn_planner.intersection.model import IntersectionModel
from sim_bridge.scenarios.fields import Interval, Obstacles
from sim_bridge.scenarios.loading import load_scenario
from sim_bridge.world.obstacles import LEFT, RIGHT, obstacle_catalogue

EGO_ROAD = shapely.box(-1.75, -100.0, 1.75, 60.0)
CROSS_ROADS = shapely.box(-100.0, -1.75, 100.0, 5.25)
SHARP = Interval(1.0, 1.0)


def fixed(**fields: Interval) -> Obstacles:
    """Rectangles of 6 m by 4 m, 1 m from each road, unless said otherwise."""
    sizes = {"length_m": Interval(6.0, 6.0), "width_m": Interval(4.0, 4.0)}
    return Obstacles(**{**sizes, "gap_ego_m": SHARP, "gap_cross_m": SHARP, **fields})


def boxes(model: IntersectionModel, config: Obstacles, side: int, **options: object) -> list:
    catalogue = obstacle_catalogue(model, config, 0, **options)
    return [shapely.Polygon(c) for c in catalogue.corners[side, : catalogue.available[side]]]


@pytest.mark.parametrize(("side", "sign"), [(LEFT, -1.0), (RIGHT, 1.0)])
def test_an_obstacle_stands_in_the_corner_of_both_roads_as_far_off_as_its_gaps_say(
    crossing_model: IntersectionModel, side: int, sign: float
):
    box = boxes(crossing_model, fixed(), side)[0]
    # 1 m off the ego's lane (x = 1.75) and off the crossing lane (y = -1.75), but for the last
    # step of placing, 3 cm.
    assert box.distance(EGO_ROAD) == pytest.approx(1.0)
    assert box.distance(CROSS_ROADS) == pytest.approx(1.0, abs=0.04)
    assert sign * box.centroid.x == pytest.approx(1.75 + 1.0 + 2.0)
    assert box.centroid.y < -1.75
    assert box.area == pytest.approx(24.0)


@pytest.mark.parametrize("name", ["base", "severe_occlusion", "close_small_obstacle"])
@pytest.mark.parametrize("side", [LEFT, RIGHT])
def test_no_placement_of_a_scenario_comes_nearer_than_its_least_gaps(
    crossing_model: IntersectionModel, name: str, side: int
):
    config = load_scenario(name).obstacles
    found = boxes(crossing_model, config, side)
    assert len(found) == 256
    for box in found:
        assert box.distance(EGO_ROAD) >= config.gap_ego_m.low - 1e-5
        assert box.distance(CROSS_ROADS) >= config.gap_cross_m.low - 1e-5
        # No further than its greatest gap and what placing in steps costs.
        assert box.distance(CROSS_ROADS) <= config.gap_cross_m.high + 0.04


def test_corners_run_counter_clockwise_on_both_sides(crossing_model: IntersectionModel):
    for side in (LEFT, RIGHT):
        assert all(box.exterior.is_ccw for box in boxes(crossing_model, fixed(), side))


def test_obstacles_keep_clear_of_further_roads(crossing_model: IntersectionModel):
    # The lane of oncoming traffic, left of the ego's.
    oncoming = np.array([(-5.25, -100.0), (-1.75, -100.0), (-1.75, 60.0), (-5.25, 60.0)])
    box = boxes(crossing_model, fixed(), LEFT, keep_out=[oncoming])[0]
    assert box.distance(shapely.Polygon(oncoming)) == pytest.approx(1.0, abs=0.04)
    assert box.centroid.x < -5.25


def test_a_world_seed_names_one_catalogue(crossing_model: IntersectionModel):
    config = load_scenario("base").obstacles
    first, same, other = (obstacle_catalogue(crossing_model, config, seed) for seed in (3, 3, 4))
    assert np.array_equal(first.corners, same.corners)
    assert not np.array_equal(first.corners, other.corners)


@pytest.fixture
def walled(crossing_model: IntersectionModel) -> Callable[[bool], object]:
    """Everything left of the ego's lane is closed to obstacles."""
    everything = np.array([(-90.0, -200.0), (-1.0, -200.0), (-1.0, 200.0), (-90.0, 200.0)])

    def catalogue(required: bool) -> object:
        config = Obstacles(required=required)
        return obstacle_catalogue(crossing_model, config, 0, keep_out=[everything])

    return catalogue


def test_a_side_without_room_stays_free(walled: Callable[[bool], object]):
    assert walled(False).available.tolist() == [0, 256]


def test_a_side_without_room_is_an_error_if_obstacles_are_required(
    walled: Callable[[bool], object],
):
    with pytest.raises(ScenarioError, match=r"no room for an obstacle on the left of route \(1,\)"):
        walled(True)


def test_a_scenario_without_obstacles_has_none(crossing_model: IntersectionModel):
    assert obstacle_catalogue(crossing_model, Obstacles(per_side=0), 0).available.tolist() == [0, 0]
