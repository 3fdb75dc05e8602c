# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from risk_dqn_planner.intersection.model import IntersectionModel
from sim_bridge.environment.interface import Outcome
from sim_bridge.evaluation.contestants import contestants
from sim_bridge.evaluation.rollout import Driven, joined, roll_out
from sim_bridge.evaluation.summary import summarise
from sim_bridge.scenarios.loading import Scenario
from sim_bridge.simulation.simulation import Simulation

SEEDS = np.arange(50)


def rolled_out(model: IntersectionModel, scenario: Scenario, name: str, batch: int) -> Driven:
    (driver,) = contestants([name])
    return joined(list(roll_out(Simulation(model, scenario, batch), driver, SEEDS)))


@pytest.mark.parametrize("name", ["rule_based", "clairvoyant"])
def test_the_result_does_not_depend_on_the_batch(
    crossing_model: IntersectionModel, busy: Scenario, name: str
) -> None:
    small, large = (rolled_out(crossing_model, busy, name, batch) for batch in (7, 50))
    np.testing.assert_array_equal(small.episodes.seed, SEEDS)
    np.testing.assert_array_equal(small.episodes.outcome, large.episodes.outcome)
    for one, other in zip(small.episodes.statistics, large.episodes.statistics, strict=True):
        np.testing.assert_array_equal(one, other)


def test_everyone_gets_the_same_episodes(crossing_model: IntersectionModel, busy: Scenario) -> None:
    # No one is ever faster than the clairvoyant on the episode that both succeed in.
    best = rolled_out(crossing_model, busy, "clairvoyant", 50).episodes
    fast = rolled_out(crossing_model, busy, "always_fast", 50).episodes
    both = fast.outcome == Outcome.SUCCESS
    assert both.any()
    assert (best.outcome[both] == Outcome.SUCCESS).all()
    # Driving fast all the way is the optimum wherever it does not collide.
    np.testing.assert_allclose(
        best.statistics.duration_s[both], fast.statistics.duration_s[both], atol=1e-9
    )


def test_a_cell_holds_each_figure_with_its_interval(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    figures = summarise(rolled_out(crossing_model, busy, "always_fast", 50))
    rates = [figures[key]["rate"] for key in ("success", "collision", "timeout")]
    assert sum(rates) == pytest.approx(1.0)
    assert figures["episodes"] == 50
    assert figures["action_share"]["fast"] == {"rate": 1.0, "low": 1.0, "high": 1.0}
    assert figures["switches_per_episode"] == {"mean": 0.0, "low": 0.0, "high": 0.0}
    for key in ("mean_speed_mps", "crossing_time_s", "min_time_gap_s"):
        assert figures[key]["low"] <= figures[key]["mean"] <= figures[key]["high"]


def test_what_never_happened_has_no_figure(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    figures = summarise(rolled_out(crossing_model, empty_road, "always_stop", 50))
    assert figures["timeout"]["rate"] == 1.0
    assert figures["crossing_time_s"] is None
    assert figures["min_time_gap_s"] is None
