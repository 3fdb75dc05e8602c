# SPDX-License-Identifier: Apache-2.0
"""An adversary that keeps the assumptions finds no collision, and finds them once it may not.

The worlds and the search are in adversary.py and merging_adversary.py.
"""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.policies.supervised import Supervisor, SupervisorMode
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.safety.joint_check import JointCheck
from risk_dqn_planner.situation.situations import Booleans, Situations


def beside(name: str) -> ModuleType:
    """Load a module that lies beside this file; tests are no package."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


adversary = beside("adversary")
merging_adversary = beside("merging_adversary")


def supervisor(
    assumptions: SafetyAssumptions | None = None,
    mode: SupervisorMode = SupervisorMode.ENFORCE,
) -> Supervisor:
    return Supervisor(adversary.Proposals(Action.FAST), mode, assumptions)


class EachLaneApart(Guard):
    """The paper's kind of condition: for each lane apart there is a manoeuvre, not one for all."""

    def look(self, situations: Situations, restart: Booleans) -> JointCheck:
        check = super().look(situations, restart)
        lanes = np.arange(situations.lane_mask.shape[1])
        admissible, periods = np.ones_like(check.admissible), check.periods
        for lane in lanes:
            alone = situations._replace(lane_mask=situations.lane_mask & (lanes == lane))
            single = super().look(alone, restart)
            admissible &= single.admissible
            periods = np.where(check.admissible, check.periods, single.periods)
        return check._replace(admissible=admissible, periods=periods)


@pytest.mark.parametrize("brave", [True, False], ids=["fastest sound action", "any proposals"])
@pytest.mark.parametrize("error_mps", [0.0, 1.5, 4.0])
def test_no_traffic_within_the_assumptions_makes_the_ego_collide(
    brave: bool, error_mps: float
) -> None:
    # The worlds' period is exact, so that the ways covered bound the speeds as well.
    assumptions = SafetyAssumptions(speed_error_mps=error_mps, period_error_s=0.0)
    found, nearest_m = adversary.search(
        supervisor(assumptions), seed=1, generations=6, brave=brave, error_mps=error_mps
    )
    assert found == 0
    # The adversary does come near: the check is not safe by doing nothing.
    assert nearest_m < 0.5


# A decision takes effect 0.1 to 0.4 s after the situation; the ego may brake like any leader.
RANGES = adversary.EgoRanges((0.1, 0.4), (1.5, 2.5), (3.5, 8.0))
RANGED = SafetyAssumptions(
    actuation_delay_s=0.4,
    actuation_jitter_s=0.3,
    ego_acceleration_factor=2.5 / 1.5,
    ego_braking_factor=8.0 / 3.5,
)


@pytest.mark.parametrize("brave", [True, False], ids=["fastest sound action", "any proposals"])
def test_an_ego_that_is_not_exact_does_not_collide_within_its_ranges(brave: bool) -> None:
    found, nearest_m = adversary.search(
        supervisor(RANGED), seed=7, generations=30, brave=brave, ranges=RANGES
    )
    assert found == 0
    assert nearest_m < 0.5


@pytest.mark.parametrize(
    "weak",
    [
        replace(RANGED, actuation_jitter_s=0.0),
        replace(RANGED, ego_acceleration_factor=1.0),
        replace(RANGED, ego_braking_factor=1.0),
    ],
    ids=["constant delay", "exact acceleration", "exact braking"],
)
def test_an_ego_taken_for_exact_that_is_not_lets_the_adversary_win(
    weak: SafetyAssumptions,
) -> None:
    assert adversary.search(supervisor(weak), seed=8, generations=60, ranges=RANGES)[0] >= 1


def test_conditions_for_each_lane_apart_let_the_adversary_win() -> None:
    weak = supervisor()
    weak._guard = EachLaneApart()
    assert adversary.search(weak, seed=2, generations=20)[0] >= 1


def test_forgotten_errors_of_measurement_let_the_adversary_win() -> None:
    assert adversary.search(supervisor(), seed=3, generations=20, error_mps=1.5)[0] >= 1


def test_a_speed_below_the_truth_ascribed_to_the_hidden_lets_the_adversary_win() -> None:
    risky = supervisor(SafetyAssumptions(hidden_top_speed_mps=3.0))
    assert adversary.search(risky, seed=4, generations=20)[0] >= 1


def test_braking_believed_too_strong_lets_the_adversary_win() -> None:
    stronger = SafetyAssumptions(ego=type(SafetyAssumptions().ego)(braking_mps2=7.0))
    assert adversary.search(supervisor(stronger), seed=5, generations=20)[0] >= 1


def test_without_a_supervisor_the_adversary_wins_everywhere() -> None:
    found, _ = adversary.search(supervisor(mode=SupervisorMode.OFF), seed=6, generations=0)
    assert found >= 10


@pytest.mark.parametrize("brave", [True, False], ids=["fastest sound action", "any proposals"])
def test_no_traffic_within_the_assumptions_hits_an_ego_that_merges(brave: bool) -> None:
    nearest_m = merging_adversary.search(supervisor(), seed=1, rows=320, generations=4, brave=brave)
    assert 0.0 < nearest_m < 1.0


@pytest.mark.parametrize("brave", [True, False], ids=["fastest sound action", "any proposals"])
def test_nobody_hits_an_ego_that_merges_and_is_not_exact(brave: bool) -> None:
    nearest_m = merging_adversary.search(
        supervisor(RANGED), seed=1, generations=8, brave=brave, ranges=RANGES
    )
    assert 0.0 < nearest_m < 1.0


@pytest.mark.parametrize(
    "weak",
    [SafetyAssumptions(follower_reaction_s=0.0), SafetyAssumptions(leader_braking_mps2=3.5)],
    ids=["followers react at once", "leaders brake gently"],
)
def test_what_others_do_not_keep_lets_the_adversary_hit_an_ego_that_merges(
    weak: SafetyAssumptions,
) -> None:
    assert merging_adversary.search(supervisor(weak), seed=3, generations=15) < 0.0
