# SPDX-License-Identifier: Apache-2.0
"""Training with an outlook and an expert: repeatable, and the same as on the vehicle."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import StopsAtGoal
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.policies.look_ahead import LookAheadConfig, LookAheadPolicy
from risk_dqn_planner.policies.outlook import Outlook
from risk_dqn_planner.policies.sound_learned import SoundLearnedPolicy
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.advisor import Advisor
from sim_bridge.environment.batch import BatchEnvironment
from sim_bridge.environment.episodes import drive
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.place import Places
from sim_bridge.environment.rewards import reward_named
from sim_bridge.environment.seeds import VALIDATION_SEEDS, fixed_seeds
from sim_bridge.learning.checkpoint import RunFolder
from sim_bridge.learning.config import AdviceConfig, ExplorationConfig, LearnerConfig
from sim_bridge.learning.export import initial_weights, network_of
from sim_bridge.learning.learner import Learner
from sim_bridge.learning.origin import origin_of
from sim_bridge.learning.run import Run
from sim_bridge.learning.session import Score, Session
from sim_bridge.scenarios.loading import load_scenario

from .tiny import TINY

pytestmark = pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")

ADVISED = Run(
    config=replace(
        TINY,
        exploration=ExplorationConfig(start=0.1, end=0.1),
        outlook=True,
        advice=AdviceConfig(until=0.5, capacity=200, batch_size=16),
    ),
    reward="progress",
    seed=3,
    map_name="four_way",
    scenario="dense_traffic",
    supervisor="enforce",
)
FOUR_WAY = Places.named("four_way")


def session(run: Run = ADVISED) -> Session:
    return Session(run, [FOUR_WAY], initial_weights(run.seed, run.outlook_size))


def environment(batch: int, advisor: Advisor | None = None) -> BatchEnvironment:
    return BatchEnvironment(
        FOUR_WAY.usual.simulation(load_scenario("dense_traffic"), batch),
        StateEncoder(),
        reward_named("progress"),
        RiskConfig(),
        0,
        outlook=Outlook(),
        advisor=advisor,
    )


def test_an_advised_run_resumes_to_the_identical_result(tmp_path: Path) -> None:
    whole, begun, resumed = (session() for _ in range(3))
    list(whole.run())
    next(begun.run())
    RunFolder(tmp_path, ADVISED).save(begun)
    assert RunFolder(tmp_path, ADVISED).resume(resumed)
    list(resumed.run())
    np.testing.assert_array_equal(resumed.last_weights, whole.last_weights)
    assert resumed.records == whole.records
    assert all(record.evaluation.collision == 0.0 for record in whole.records)


def test_an_exported_policy_drives_as_validation_said(tmp_path: Path) -> None:
    one = session()
    list(one.run())
    path = RunFolder(tmp_path, ADVISED).finish(one, "tiny")
    policy = load_policy(str(path))
    assert isinstance(policy, StopsAtGoal)
    assert isinstance(policy.policy, SoundLearnedPolicy)
    policy.policy.switching_value = 0.0  # validation goes by what the network says alone
    simulation = FOUR_WAY.usual.simulation(load_scenario("dense_traffic"), 5)
    driven = drive(simulation, policy, fixed_seeds(VALIDATION_SEEDS, 5))
    assert one.best is not None
    assert Score.of([driven]) == one.best.score
    assert origin_of(path).run["config"]["advice"]["capacity"] == 200


def test_the_vehicle_decides_as_training_does() -> None:
    weights = initial_weights(3, ADVISED.outlook_size)
    weights[-1] += 1.0  # such as to prefer Fast by far, and be overruled often
    learner = Learner(LearnerConfig(), weights)
    vehicle = SoundLearnedPolicy(network_of(weights), "fast", "", switching_value=0.0)
    one = environment(16)
    states, begun = one.reset(), np.ones(16, dtype=np.bool_)
    running, overruled = begun, 0
    for _ in range(80):
        values = learner.q_values(states)
        trained = np.where(one.sound, values, -np.inf).argmax(axis=1)
        decisions = vehicle.decide(one.simulation.situations(), begun)
        np.testing.assert_array_equal(decisions.action[running], trained[running])
        overruled += int((values.argmax(axis=1) != trained).sum())
        step = one.step(trained)
        states, begun, running = step.states, ~step.taken, step.outcome == Outcome.RUNNING
    assert overruled > 100


def test_advice_is_what_the_look_ahead_policy_does() -> None:
    config = LookAheadConfig()
    one = environment(16, Advisor(SafetyAssumptions(), config))
    expert = LookAheadPolicy(SafetyAssumptions(), config)
    one.reset()
    begun, different = np.ones(16, dtype=np.bool_), 0
    for _ in range(60):
        advised = one.advice()
        expected = expert.decide(one.simulation.situations(), begun).action
        np.testing.assert_array_equal(advised, expected)
        different += int((advised != 2).sum())
        begun = ~one.step(advised).taken
    assert different > 100


def test_nobody_can_be_asked_where_there_is_no_adviser() -> None:
    one = environment(2)
    one.reset()
    with pytest.raises(ConfigurationError, match="advice needs an adviser"):
        one.advice()


def test_a_network_that_is_told_what_is_sound_trains_under_the_supervisor_alone() -> None:
    with pytest.raises(ConfigurationError, match=r"supervisor is 'off', expected enforce"):
        replace(ADVISED, supervisor="off")
