# SPDX-License-Identifier: Apache-2.0
from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.geometry.footprint import footprints_overlap
from risk_dqn_planner.geometry.polyline import Polyline
from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import load_map
from risk_dqn_planner.vehicle import VehicleDimensions
from sim_bridge.maps import shipped_map
from sim_bridge.scenarios.fields import CarFollowing
from sim_bridge.scenarios.loading import Scenario
from sim_bridge.simulation.right_of_way import crossings, goes_first
from sim_bridge.simulation.settings import idm_of
from sim_bridge.simulation.simulation import Simulation
from sim_bridge.world.path_geometry import sampled

WithVehicles = Callable[..., Scenario]
IDM = idm_of(CarFollowing())
ways, speeds = st.floats(0.1, 60.0), st.floats(0.0, 7.0)


def test_paths_cross_where_their_footprints_touch():
    lines = [
        Polyline.from_points([(-50.0, 0.0), (50.0, 0.0)]),
        Polyline.from_points([(0.0, -30.0), (0.0, 30.0)]),
        Polyline.from_points([(50.0, 3.5), (-50.0, 3.5)]),
    ]
    tables = np.array([sampled(line, 201) for line in lines])
    shared = np.eye(3, dtype=np.bool_)
    found = crossings(tables, shared, VehicleDimensions(4.0, 2.0))
    # 3 m either side of the crossing point, and at most 1.75 m of margins.
    assert 50.0 - 4.75 <= found.enter_m[0, 1] <= 47.0
    assert 53.0 <= found.exit_m[0, 1] <= 50.0 + 4.75
    assert 30.0 - 4.75 <= found.enter_m[1, 0] <= 27.0
    # Lanes side by side do not cross, nor does a path cross itself or one that shares its lane.
    assert found.enter_m[0, 2] == np.inf
    assert (np.diag(found.enter_m) == np.inf).all()
    assert found.exist
    together = np.ones((3, 3), dtype=np.bool_)
    assert not crossings(tables, together, VehicleDimensions(4.0, 2.0)).exist


@pytest.mark.parametrize(
    ("way", "speed", "other_way", "other_speed", "first"),
    [
        (10.0, 5.0, 12.0, 5.0, True),  # 2.0 s before 2.4 s
        (12.0, 5.0, 10.0, 5.0, False),
        (2.0, 0.0, 10.0, 5.0, True),  # sets off at 3 m/s: 0.7 s before 2.0 s
        (4.0, 5.0, 0.5, 0.0, True),  # cannot stop: 25 / (2 * 1.5 * 2) = 4.17 m
        (4.2, 5.0, 0.5, 0.0, False),  # can
    ],
)
def test_the_one_that_arrives_first_or_cannot_stop_goes_first(
    way: float, speed: float, other_way: float, other_speed: float, first: bool
):
    assert goes_first(way, speed, other_way, other_speed, IDM) == first


@given(ways, speeds, ways, speeds)
def test_never_do_both_go_first(way: float, speed: float, other_way: float, other_speed: float):
    one = goes_first(way, speed, other_way, other_speed, IDM)
    other = goes_first(other_way, other_speed, way, speed, IDM)
    assert not (one and other)


def own_map(name: str) -> IntersectionModel:
    place = shipped_map(name)
    return build_intersection(load_map(place.path, place.origin), place.route)


@pytest.mark.parametrize("name", ["t_junction", "multi_lane"])
def test_vehicles_whose_paths_cross_or_join_do_not_drive_through_each_other(
    name: str, with_vehicles: WithVehicles, base: Scenario
):
    simulation = Simulation(own_map(name), with_vehicles(base, 10), 12)
    simulation.reset(np.arange(12))
    for _ in range(100):
        simulation.step(np.zeros(12))
        poses = simulation.vehicle_poses()
        for row in range(12):
            mask = poses.mask[row]
            columns = (poses.x_m, poses.y_m, poses.heading_rad)
            there = np.column_stack([column[row, mask] for column in columns])
            for a, b in combinations(there, 2):
                assert not footprints_overlap(*a, 4.0, 2.0, *b, 4.0, 2.0)
    came = simulation.state.episodes.next_id - 11
    # Nor do they block each other: within 50 s every place was taken anew, on average.
    assert came.mean() > 10.0
