# SPDX-License-Identifier: Apache-2.0
"""What the guard believes of others' speeds, against the simulator's truth."""

import dataclasses

import numpy as np
import pytest

from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.speeds import SpeedBounds
from sim_bridge.environment.place import load_place
from sim_bridge.environment.seeds import VALIDATION_SEEDS, fixed_seeds
from sim_bridge.scenarios.loading import load_scenario

EPISODES, DECISIONS = 60, 50


@pytest.mark.parametrize("map_name", ["four_way", "t_junction", "multi_lane", "roundabout"])
def test_true_speeds_lie_within_the_bounds(map_name: str) -> None:
    # Seven deviations: then no error of these episodes is beyond what is assumed.
    assumptions = SafetyAssumptions(speed_error_mps=7.0, period_error_s=0.0)
    noisy = load_scenario("sensor_noise")
    noisy = dataclasses.replace(noisy, traffic=load_scenario("dense_traffic").traffic)
    exact = dataclasses.replace(
        noisy, sensor=dataclasses.replace(noisy.sensor, velocity_noise_mps=0.0)
    )
    place = load_place(map_name)
    perceived, true = (place.simulation(each, EPISODES) for each in (noisy, exact))
    policy, memory = FastestSoundPolicy(assumptions), SpeedBounds(assumptions)
    slack_mps = []
    for simulation in (perceived, true):
        simulation.reset(fixed_seeds(VALIDATION_SEEDS, EPISODES))
    for k in range(DECISIONS):
        s, t = perceived.situations(), true.situations()
        restart = np.full(EPISODES, k == 0)
        speeds = memory.look(s, restart)
        there = s.vehicle_mask & perceived.state.episodes.running[:, None]
        truth_mps = t.vehicle_speed_mps[there]
        np.testing.assert_array_equal(s.vehicle_id[there], t.vehicle_id[there])
        assert (speeds.low_mps[there] <= truth_mps + 1e-9).all()
        assert (truth_mps <= speeds.high_mps[there] + 1e-9).all()
        slack_mps.append(speeds.high_mps[there] - truth_mps)
        action = policy.decide(s, restart).action
        for simulation in (perceived, true):
            simulation.step(action)
    assert np.concatenate(slack_mps).mean() < 1.6
