# SPDX-License-Identifier: Apache-2.0
"""An ego that follows a merged vehicle to its goal can stop behind it, wherever that stopped."""

import numpy as np
import pytest

from risk_dqn_planner.intersection.builder import build_intersection
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.map.loader import load_map
from risk_dqn_planner.policies.fastest_sound import FastestSoundPolicy
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.joint_check import target_of
from risk_dqn_planner.situation.builder import SituationBuilder
from risk_dqn_planner.situation.inputs import EgoPose, object_arrays
from sim_bridge.maps import shipped_map

P = SafetyAssumptions().numbers()
FULL_VIEW = np.array([[-500.0, -500.0], [500.0, -500.0], [500.0, 500.0], [-500.0, 500.0]])


def at_goal_or_rest(model: IntersectionModel, leader_m: float) -> tuple[float, float]:
    """Return place and speed of an ego that drove behind a leader at rest, by its own path."""
    line = model.ego_path.centerline
    builder, policy = SituationBuilder(model), FastestSoundPolicy()
    leader = object_arrays([[*line.position(leader_m), line.heading_at(leader_m), 0.0]])
    s, mps, restart = model.goal_m - 30.0, 5.0, True
    for _ in range(100):
        ego = EgoPose(*line.position(s), line.heading_at(s), mps)
        decisions = policy.decide(builder.build(ego, leader, FULL_VIEW), np.array([restart]))
        restart = False
        target_mps = target_of(decisions.action[0], P)
        motion = (P.period_s, mps, target_mps, P.ego_up_mps2, P.ego_down_mps2)
        s, mps = s + float(distance_after(*motion)), float(speed_after(*motion))
        if s >= model.goal_m:
            break
    return s, mps


@pytest.mark.parametrize("name", ["t_junction", "multi_lane", "roundabout"])
@pytest.mark.parametrize("past_goal_m", [-3.0, 0.1, 2.0, 4.0, 6.0, 8.0, 10.0])
def test_the_ego_can_stop_behind_a_leader_at_rest(name: str, past_goal_m: float) -> None:
    shipped = shipped_map(name)
    model = build_intersection(load_map(shipped.path, shipped.origin), shipped.route)
    leader_m = model.goal_m + past_goal_m
    s, mps = at_goal_or_rest(model, leader_m)
    between_m = model.ego_dimensions.length_m  # of centres in contact: both are as long
    assert s + 0.5 * mps**2 / P.ego_down_mps2 <= leader_m - between_m
