# SPDX-License-Identifier: Apache-2.0
"""After the warm-up no explanation calls the compiler; tried in a process of its own."""

import subprocess
import sys

PROGRAM = """
import numpy as np
from numba.core.event import install_recorder
from risk_dqn_planner.explanation import timing
from risk_dqn_planner.explanation.answer import Pair
from risk_dqn_planner.explanation.warm_up import warm_up
from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.warm_up import example_situation

config, assumptions = RuleBasedConfig(), SafetyAssumptions()
situation = example_situation()
with install_recorder("numba:compiler_lock") as warming:
    warm_up(config, assumptions)
merging = situation._replace(
    lane_merging=np.ones_like(situation.lane_merging),
    vehicle_distance_m=np.full_like(situation.vehicle_distance_m, -9.0),
)
with install_recorder("numba:compiler_lock") as explaining:
    for by in (timing.of_prediction(config, assumptions),
               timing.of_check(assumptions, Action.SLOW)):
        for s in (situation, merging):
            for action in Action:
                timing.nearest(s, action, by)
                assert (timing.tightest_leader(s, action, by) is None) == (s is situation)
                for periods in (timing.GO, 1, 3):
                    timing.leave_time(s, 0, action, by, periods)
            for whom in (Pair(0, 0), Pair(-1, 0)):
                timing.arrival_time(s, whom, by)
                timing.distance_and_speed(s, whom, by)
            timing.ahead_of_ego(s, Pair(0, 0))
print(len(warming.buffer) > 0, len(explaining.buffer))
"""


def test_after_the_warm_up_no_explanation_waits_for_the_compiler() -> None:
    done = subprocess.run(  # noqa: S603 (our own Python)
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, timeout=300
    )
    assert done.stdout.split() == ["True", "0"]
