# SPDX-License-Identifier: Apache-2.0
"""What the simulator's sensors report, noisy or wrong, is never a fault of an input."""

import numpy as np
import pytest

from risk_dqn_planner.map.loader import load_map
from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.situation.inputs import EgoPose, Perception
from risk_dqn_planner.situation.plausibility import Plausibility
from sim_bridge.ros.building import SimulationShelf
from sim_bridge.ros.publishing import perceived
from sim_bridge.ros.run_settings import own_map_settings
from sim_bridge.scenarios.loading import scenario_names
from sim_bridge.simulation.simulation import Simulation

SEEDS = range(2)
MOST_STEPS = 250
FRAMES_A_DECISION = 5


@pytest.fixture(scope="module")
def shelf() -> SimulationShelf:
    settings = own_map_settings("four_way")
    road_map = load_map(settings.map_file, settings.origin, settings.projector)
    return SimulationShelf(road_map, settings.route)


def frame(simulation: Simulation) -> Perception:
    """What is published of one moment, numbers rounded as in messages."""
    size = simulation.model.traffic_dimensions
    seen = perceived(
        simulation.vehicle_poses(), simulation.phantom_poses(), size.length_m, size.width_m
    )
    area = simulation.visible_area().astype(np.float32).astype(np.float64)
    return Perception(EgoPose(*simulation.ego_poses()[0].tolist()), seen, area)


@pytest.mark.parametrize("scenario", scenario_names())
def test_no_scenario_trips_a_check(shelf: SimulationShelf, scenario: str) -> None:
    simulation, node, frames = shelf.get(scenario), Plausibility(), 0
    step_s = simulation.scenario.timing.inner_step_s
    for seed in SEEDS:
        simulation.reset([seed])
        node.forget()
        actions = np.random.default_rng(seed).choice(list(Action), MOST_STEPS)
        for step in range(MOST_STEPS):
            node.check(frame(simulation), step * step_s, step * step_s)
            frames += 1
            result = simulation.inner_step([actions[step // FRAMES_A_DECISION]])
            if result.terminated[0] or result.truncated[0]:
                break
    assert frames > 20
