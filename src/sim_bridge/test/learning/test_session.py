# SPDX-License-Identifier: Apache-2.0
import json
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import StopsAtGoal
from risk_dqn_planner.policies.learned import LearnedPolicy
from risk_dqn_planner.policies.policy_file import load_policy_file
from risk_dqn_planner.policies.supervised import Supervisor
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.batch import BatchEnvironment
from sim_bridge.environment.episodes import drive
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.place import Place, Places, load_place
from sim_bridge.environment.rewards import reward_named
from sim_bridge.environment.seeds import VALIDATION_SEEDS, fixed_seeds
from sim_bridge.learning.checkpoint import RunFolder
from sim_bridge.learning.export import initial_weights, network_of
from sim_bridge.learning.learner import Learner
from sim_bridge.learning.origin import origin_of
from sim_bridge.learning.run import Run
from sim_bridge.learning.session import Score, Session
from sim_bridge.learning.train import main
from sim_bridge.scenarios.loading import load_scenario

from . import tiny

TINY = Run(
    config=tiny.TINY,
    reward="risk_with_occlusions",
    seed=3,
    map_name="four_way",
    scenario="base",
)


@lru_cache
def place(map_name: str = "four_way") -> Places:
    return Places.named(map_name)


def session(run: Run = TINY) -> Session:
    return Session(run, [place()], initial_weights(run.seed))


def test_interrupted_run_resumes_to_the_bit_identical_result(tmp_path: Path) -> None:
    whole = session()
    list(whole.run())
    begun = session()
    going = begun.run()
    next(going)
    next(going)
    RunFolder(tmp_path, TINY).save(begun)
    resumed = session()
    assert RunFolder(tmp_path, TINY).resume(resumed)
    list(resumed.run())
    np.testing.assert_array_equal(resumed.last_weights, whole.last_weights)
    assert resumed.records == whole.records
    assert resumed.best is not None
    assert whole.best is not None
    np.testing.assert_array_equal(resumed.best.weights, whole.best.weights)


def test_another_seed_gives_another_result() -> None:
    first, second = session(), session(replace(TINY, seed=4))
    list(first.run())
    list(second.run())
    assert not np.array_equal(first.last_weights, second.last_weights)


def test_lanes_reach_as_far_as_the_sensor_of_each_scenario_sees() -> None:
    asked: list[float] = []

    def load(reach_m: float) -> Place:
        asked.append(reach_m)
        return load_place("four_way", reach_m=reach_m)

    Session(replace(TINY, scenario="base,demo_light"), [Places(load)], initial_weights(3))
    assert asked == [70.0, 100.0]


def test_a_run_on_maps_and_scenarios_resumes_to_the_identical_result(tmp_path: Path) -> None:
    both = replace(TINY, map_name="four_way,t_junction", scenario="base,dense_traffic")
    places = [place(), place("t_junction")]
    whole, begun, resumed = (Session(both, places, initial_weights(3)) for _ in range(3))
    list(whole.run())
    next(begun.run())
    RunFolder(tmp_path, both).save(begun)
    assert RunFolder(tmp_path, both).resume(resumed)
    list(resumed.run())
    np.testing.assert_array_equal(resumed.last_weights, whole.last_weights)
    assert resumed.records == whole.records
    assert whole.records[-1].validation is not None
    assert whole.records[-1].validation.episodes == TINY.config.evaluation.validation_episodes


def test_a_run_needs_an_environment_for_each_map_and_scenario() -> None:
    names = ",".join(["base"] * 5)
    with pytest.raises(ConfigurationError, match=r"4 environments .* 5 combinations"):
        session(replace(TINY, scenario=names))


def test_validation_comes_every_second_report_and_at_the_end() -> None:
    one = session()
    list(one.run())
    *former, last = one.records
    assert [record.validation is not None for record in former] == [
        k % 2 == 1 for k in range(len(former))
    ]
    assert last.validation is not None
    assert last.steps >= TINY.config.steps


def test_best_is_that_of_highest_rank() -> None:
    one = session()
    list(one.run())
    scores = [record.validation for record in one.records if record.validation]
    assert one.best is not None
    assert one.best.score.rank == max(score.rank for score in scores)


def test_a_collision_undoes_a_success_and_speed_breaks_ties() -> None:
    careful = Score(100, success=0.90, collision=0.0, timeout=0.10, mean_speed_mps=2.0)
    daring = Score(100, success=0.95, collision=0.05, timeout=0.0, mean_speed_mps=3.0)
    quick = replace(daring, success=0.97, collision=0.03, mean_speed_mps=2.5)
    assert max((careful, daring), key=lambda s: s.rank) is daring
    assert max((careful, daring, quick), key=lambda s: s.rank) is quick


def test_exported_policy_drives_as_validation_said(tmp_path: Path) -> None:
    one = session()
    list(one.run())
    file = load_policy_file(RunFolder(tmp_path, TINY).finish(one, "tiny"))
    policy = LearnedPolicy(file.module, file.name, file.sha256)
    simulation = place().usual.simulation(load_scenario("base"), 5)
    driven = drive(simulation, policy, fixed_seeds(VALIDATION_SEEDS, 5))
    assert one.best is not None
    assert Score.of([driven]) == one.best.score
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["sha256"] == file.sha256
    assert file.contract["training"]["run"]["seed"] == TINY.seed
    assert file.contract["maps"] == ["four_way"]


def test_a_folder_of_another_run_is_refused(tmp_path: Path) -> None:
    one = session()
    next(one.run())
    RunFolder(tmp_path, TINY).save(one)
    config = replace(TINY.config, gamma=0.5)
    other = replace(TINY, seed=9, config=config, route="3, 4")
    text = (
        rf"holds another training run: config.gamma was {TINY.config.gamma}, now 0.5; "
        rf"route was None, now 3, 4; seed was {TINY.seed}, now 9; choose another"
    )
    with pytest.raises(ConfigurationError, match=text):
        RunFolder(tmp_path, other).resume(session(other))


def test_a_damaged_checkpoint_is_refused(tmp_path: Path) -> None:
    (tmp_path / "checkpoint.pickle").write_bytes(b"no pickle")
    with pytest.raises(ConfigurationError, match="cannot be read"):
        RunFolder(tmp_path, TINY).resume(session())


def test_command_trains_once_and_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--reward", "collision", "--steps", "1200", "--out", str(tmp_path)]
    assert main(arguments) == 0
    assert {"policy.pt", "history.json", "result.json"} <= {p.name for p in tmp_path.iterdir()}
    assert not (tmp_path / "checkpoint.pickle").exists()
    capsys.readouterr()
    assert main(arguments) == 0
    assert "is trained already" in " ".join(capsys.readouterr().out.split())


def test_command_names_what_it_cannot_use(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--reward", "comfort"]) == 2
    assert "there is no reward 'comfort'" in capsys.readouterr().err
    assert main(["--preset", "fast"]) == 2
    assert "there is no preset 'fast'" in capsys.readouterr().err
    assert main(["--projector", "globe"]) == 2
    assert "unknown map projector 'globe'" in capsys.readouterr().err
    assert main(["--name", "../elsewhere"]) == 2
    assert "name is '../elsewhere', expected one without slashes" in capsys.readouterr().err
    assert main(["--seed", "-1"]) == 2
    assert "seed is -1, expected 0 to 9223372036854775807" in capsys.readouterr().err


def test_a_folder_that_cannot_be_written_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("in the way")
    out = tmp_path / "file" / "run"
    assert main(["--steps", "20", "--out", str(out)]) == 2
    assert f"error: cannot write to {out}: Not a directory" in capsys.readouterr().err


def test_without_supervisor_and_memory_a_run_ends_as_it_did_before_there_were_any() -> None:
    one = session()
    list(one.run())
    weights = one.last_weights
    # Sums over all 35163 weights, as the revision before computed them.
    assert float(weights.sum()) == pytest.approx(61.44294738769531, rel=1e-4)
    assert float(np.abs(weights).sum()) == pytest.approx(1595.775390625, rel=1e-5)
    assert TINY.description().keys() == {"config", "reward", "seed", "map_name", "scenario"}


SUPERVISED = replace(TINY, supervisor="enforce", memory="tracked", reward="progress")


def test_a_supervised_run_resumes_to_the_identical_result(tmp_path: Path) -> None:
    whole, begun, resumed = (session(SUPERVISED) for _ in range(3))
    list(whole.run())
    next(begun.run())
    RunFolder(tmp_path, SUPERVISED).save(begun)
    assert RunFolder(tmp_path, SUPERVISED).resume(resumed)
    list(resumed.run())
    np.testing.assert_array_equal(resumed.last_weights, whole.last_weights)
    assert resumed.records == whole.records
    scores = [record.validation for record in whole.records if record.validation]
    assert all(score.collision == 0.0 for score in scores)


def test_the_vehicle_decides_as_training_under_the_supervisor_does() -> None:
    weights = initial_weights(3)
    weights[-1] += 1.0  # such as to prefer Fast by far, and be overruled often
    learner = Learner(SUPERVISED.config.learner, weights)
    vehicle = Supervisor(StopsAtGoal(LearnedPolicy(network_of(weights), "fast", "")))
    simulation = place().usual.simulation(load_scenario("dense_traffic"), 16)
    environment = BatchEnvironment(
        simulation, StateEncoder(), reward_named("progress"), RiskConfig(), 0, guard=Guard()
    )
    states, begun = environment.reset(), np.ones(16, dtype=np.bool_)
    running, overruled = begun, 0
    for _ in range(80):
        values = learner.q_values(states)
        trained = np.where(environment.sound, values, -np.inf).argmax(axis=1)
        decisions = vehicle.decide(simulation.situations(), begun)
        np.testing.assert_array_equal(decisions.action[running], trained[running])
        overruled += int((values.argmax(axis=1) != trained).sum())
        step = environment.step(trained)
        states, begun, running = step.states, ~step.taken, step.outcome == Outcome.RUNNING
    assert overruled > 100


def test_a_supervised_policy_tells_what_it_was_trained_under(tmp_path: Path) -> None:
    one = session(SUPERVISED)
    list(one.run())
    path = RunFolder(tmp_path, SUPERVISED).finish(one, "tiny")
    run = load_policy_file(path).contract["training"]["run"]
    assert run["supervisor"] == "enforce"
    assert run["memory"] == "tracked"
    assert run["assumptions"] == asdict(SafetyAssumptions())
    origin = origin_of(path)
    assert origin.company == [("supervisor", "enforce"), ("memory", "tracked")]
    assert "SUPERVISOR=enforce MEMORY=tracked" in origin.command()


def test_exported_supervised_policy_drives_as_validation_said(tmp_path: Path) -> None:
    one = session(SUPERVISED)
    list(one.run())
    file = load_policy_file(RunFolder(tmp_path, SUPERVISED).finish(one, "tiny"))
    policy = Supervisor(LearnedPolicy(file.module, file.name, file.sha256))
    simulation = place().usual.simulation(load_scenario("base"), 5, "tracked")
    driven = drive(simulation, policy, fixed_seeds(VALIDATION_SEEDS, 5))
    assert one.best is not None
    assert Score.of([driven]) == one.best.score


def test_only_a_supervisor_that_acts_is_of_use_in_training() -> None:
    with pytest.raises(ConfigurationError, match=r"supervisor is 'report', .* off, enforce"):
        replace(TINY, supervisor="report")
    with pytest.raises(ConfigurationError, match="supervisor is 'on'"):
        replace(TINY, supervisor="on")
    with pytest.raises(ConfigurationError, match="memory is 'long'"):
        replace(TINY, memory="long")
