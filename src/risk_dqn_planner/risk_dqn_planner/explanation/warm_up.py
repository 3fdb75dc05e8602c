# SPDX-License-Identifier: Apache-2.0
"""Lets everything that explanations compute be compiled, or loaded, before it is needed.

Which kernels an explanation needs depends on whom it is about. Without this the first vehicle that
mattered would keep its decision waiting for the compiler for a quarter of a second.
"""

import numpy as np

from risk_dqn_planner.explanation import timing
from risk_dqn_planner.explanation.answer import NOBODY, Pair
from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.course import GO
from risk_dqn_planner.situation.warm_up import example_situation


def warm_up(config: RuleBasedConfig, assumptions: SafetyAssumptions) -> None:
    """Reckon all times of a seen vehicle, a hidden one and one that has joined the ego's path."""
    crossing = example_situation()
    joined = crossing._replace(
        lane_merging=np.ones_like(crossing.lane_merging),
        # Its zone is behind it, and the ego's still far ahead.
        vehicle_distance_m=-crossing.lane_zone_m[:, :1].repeat(
            crossing.vehicle_distance_m.shape[1], axis=1
        ),
    )
    seen, hidden = Pair(0, 0), Pair(NOBODY, 0)
    for by in (
        timing.of_prediction(config, assumptions),
        timing.of_check(assumptions, Action.STOP),
    ):
        for whom in (seen, hidden):
            timing.arrival_time(crossing, whom, by)
            timing.distance_and_speed(crossing, whom, by)
        for periods in (GO, 1):
            timing.leave_time(crossing, 0, Action.FAST, by, periods)
        timing.nearest(crossing, Action.FAST, by)
        timing.ahead_of_ego(joined, seen)
        timing.tightest_leader(joined, Action.FAST, by)
