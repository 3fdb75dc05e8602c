# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from risk_dqn_planner.situation.inputs import EgoPose
from sim_bridge.environment.place import load_place
from sim_bridge.perception.poses import VehiclePoses
from sim_bridge.ros.publishing import ground_truth, perceived
from sim_bridge.scenarios.loading import load_scenario


def poses(hidden: list[bool], present: list[bool]) -> VehiclePoses:
    """Vehicles 10, 11, ... that measure 0.5 m/s more than they drive."""
    count = len(hidden)
    ones = np.ones((1, count))
    return VehiclePoses(
        mask=np.array([present], dtype=np.bool_),
        id=10 + np.arange(count)[None, :],
        x_m=3.0 * ones,
        y_m=4.0 * ones,
        heading_rad=0.1 * ones,
        speed_mps=6.0 * ones,
        measured_speed_mps=6.5 * ones,
        hidden=np.array([hidden], dtype=np.bool_),
    )


def test_the_sensor_reports_measured_speeds_of_what_it_sees() -> None:
    nothing = poses([], [])
    seen = perceived(poses([False, True, False], [True, True, False]), nothing, 4.0, 2.0)
    assert seen.id.tolist() == [10]
    assert seen.speed_mps.tolist() == [6.5]
    assert (seen.length_m.tolist(), seen.width_m.tolist()) == ([4.0], [2.0])


def test_the_sensor_reports_phantoms_after_the_vehicles_it_sees() -> None:
    phantoms = poses([False, False], [False, True])
    seen = perceived(poses([False, True], [True, True]), phantoms, 4.0, 2.0)
    assert seen.id.tolist() == [10, 11]


def test_the_truth_has_hidden_vehicles_with_their_true_speed_and_the_obstacles() -> None:
    simulation = load_place("four_way").simulation(load_scenario("base"), 1)
    simulation.reset([1])
    ego = EgoPose(1.0, 2.0, 0.5, 3.0)
    everything = poses([False, True, False], [True, True, False])
    truth = ground_truth(simulation, ego, everything, 7, 1_500_000_000, "map")
    assert [(vehicle.id, vehicle.hidden) for vehicle in truth.vehicles] == [(10, False), (11, True)]
    assert {vehicle.speed_mps for vehicle in truth.vehicles} == {6.0}
    assert (truth.seed, truth.ego.x_m, truth.ego.length_m) == (7, 1.0, 4.0)
    assert len(truth.obstacles) == len(simulation.obstacles()) > 0
    first = truth.obstacles[0].points[0]
    assert (first.x, first.y) == pytest.approx(tuple(simulation.obstacles()[0][0]))
