# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

from risk_dqn_planner.intersection.model import IntersectionModel
from sim_bridge.scenarios.fields import Sensor
from sim_bridge.scenarios.loading import Scenario
from sim_bridge.world.entries import entries_in_range
from sim_bridge.world.world import build_world


def test_where_the_map_begins_in_sight_it_is_told_how_far_before_the_zone(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    # Zones lie 100 m along paths that the map does not continue.
    first, second = (lane.lane_id for lane in crossing_model.lanes)
    far = build_world(crossing_model, replace(empty_road, sensor=Sensor(range_m=120.0)))
    assert entries_in_range(far) == {first: 100.0, second: 100.0}
    near = build_world(crossing_model, replace(empty_road, sensor=Sensor(range_m=70.0)))
    assert entries_in_range(near) == {}
