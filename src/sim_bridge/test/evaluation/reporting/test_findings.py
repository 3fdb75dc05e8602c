# SPDX-License-Identifier: Apache-2.0
"""Verdicts and reasons follow from the data, not from what anybody expects."""

from typing import Any

import numpy as np
import pytest

from sim_bridge.evaluation.cells import FINITE, RESPAWNING
from sim_bridge.evaluation.reporting.curiosities import curiosities
from sim_bridge.evaluation.reporting.curves import Curve
from sim_bridge.evaluation.reporting.findings import (
    about_actions,
    about_challenges,
    about_ranges,
    about_training,
)
from sim_bridge.evaluation.reporting.markdown import as_percent
from sim_bridge.evaluation.reporting.reasons import reasons
from sim_bridge.evaluation.reporting.selection import Line, Spread, actions_normalised
from sim_bridge.evaluation.reporting.verdicts import Finding, more
from sim_bridge.evaluation.statistics import wilson


def share(rate: float, episodes: int = 2000) -> dict[str, float]:
    return wilson(round(rate * episodes), episodes)._asdict()


def a_line(policy: str, scenario: str, success: float, collision: float, **more: Any) -> Line:  # noqa: ANN401
    """A cell with a success and a collision rate; all else is beside the point."""
    mean = {"mean": 1.0, "low": 0.99, "high": 1.01}
    actions = dict.fromkeys(("stop", "slow", "fast"), mean)
    return {
        "policy": policy,
        "policy_hash": policy,
        "training_seed": None,
        "scenario": scenario,
        "traffic": RESPAWNING,
        "sensor_range_m": 70.0,
        "episodes": 2000,
        "success": share(success),
        "collision": share(collision),
        "timeout": share(1.0 - success - collision),
        "mean_speed_mps": mean,
        "actions_per_episode": actions,
    } | more


def speed(mean: float) -> dict[str, float]:
    return {"mean": mean, "low": mean - 0.01, "high": mean + 0.01}


def holds(findings: list[Finding], words: str, traffic: str = RESPAWNING) -> bool | None:
    (found,) = [each for each in findings if words in each.statement]
    return found.verdicts[traffic].holds


@pytest.mark.parametrize(
    ("ours", "other", "expected"),
    [
        (Spread(0.9, 0.85, 0.95, 1), Spread(0.5, 0.4, 0.6, 1), True),
        (Spread(0.5, 0.4, 0.6, 1), Spread(0.9, 0.85, 0.95, 1), False),
        (Spread(0.9, 0.85, 0.95, 1), Spread(0.88, 0.8, 0.9, 1), None),
        (Spread(1.0, 1.0, 1.0, 3), Spread(1.0, 1.0, 1.0, 3), False),
    ],
)
def test_a_difference_counts_where_the_intervals_do_not_overlap(
    ours: Spread, other: Spread, expected: bool | None
) -> None:
    verdict = more(ours, other, as_percent)
    assert verdict is not None
    assert verdict.holds is expected


def test_who_collides_more_is_read_from_the_cells() -> None:
    lines = [
        a_line("collision_aware_paper", "severe_occlusion", 0.813, 0.187),
        a_line("risk_aware_paper", "severe_occlusion", 0.0, 0.0),
    ]
    found = about_challenges(lines)
    assert holds(found, "collides more than the risk-aware one: severe occlusion") is True
    assert holds(found, "succeeds more than the collision-aware one: severe occlusion") is False
    (text,) = [str(each.verdicts[RESPAWNING]) for each in found if "collides" in each.statement]
    assert text == "**yes**: 18.7% against 0.0%"
    assert all(FINITE not in each.verdicts for each in found)


def test_what_was_not_driven_is_not_judged() -> None:
    assert about_challenges([a_line("risk_aware_paper", "sensor_noise", 1.0, 0.0)]) == []
    assert about_ranges([a_line("always_fast", "base", 0.5, 0.5)]) == []


def test_the_rule_falls_or_rises_with_the_range_as_measured() -> None:
    for speeds, expected in (((2.16, 1.25), True), ((1.25, 2.16), False)):
        lines = [
            a_line("rule_based", "base", 0.5, 0.0, sensor_range_m=range_m, mean_speed_mps=speed(v))
            for range_m, v in zip((60.0, 90.0), speeds, strict=True)
        ]
        assert holds(about_ranges(lines), "slower at 90 m than at 60 m") is expected


def test_actions_are_counted_relative_to_the_rule() -> None:
    def counts(**means: float) -> dict[str, dict[str, float]]:
        return {action: {"mean": m, "low": m, "high": m} for action, m in means.items()}

    rule = a_line("rule_based", "base", 1, 0, actions_per_episode=counts(stop=10, slow=4, fast=0))
    risk = a_line(
        "risk_aware_paper", "base", 1, 0, actions_per_episode=counts(stop=5, slow=8, fast=3)
    )
    ours = actions_normalised([risk], [rule])
    assert {action: value.value for action, value in ours.items()} == {"stop": 0.5, "slow": 2.0}
    found = about_actions([rule, risk])
    assert holds(found, "drives slow more than the rule") is True
    assert holds(found, "the rule stops more than the risk-aware") is True


def test_one_seed_does_not_decide_which_reward_learns_more_smoothly() -> None:
    steps = np.arange(1.0, 41.0)
    smooth = [Curve(k, steps, np.full(40, 0.95)) for k in range(2)]
    rough = [Curve(k, steps, np.tile([0.7, 1.0 - 0.01 * k], 20)) for k in range(2)]
    curves = {"risk_aware_paper": smooth, "collision_aware_paper": rough}
    assert [verdict.holds for _, verdict in about_training(curves)] == [False, True]
    alone = {name: each[:1] for name, each in curves.items()}
    assert about_training(alone)[1][1].holds is None


def test_a_reason_is_told_only_where_the_data_show_what_it_explains() -> None:
    frozen = [a_line("risk_aware_paper", "severe_occlusion", 0.0, 0.0)]
    assert "waits for ever" in reasons(frozen)
    assert "100.0% in severe occlusion, respawning" in reasons(frozen)
    assert "waits for ever" not in reasons(
        [a_line("risk_aware_paper", "severe_occlusion", 1.0, 0.0)]
    )
    bold = [a_line("collision_aware_paper", "severe_occlusion", 0.8, 0.2)]
    # +1 and -2 break even at one collision in three.
    assert "more than 66.7% of cases" in reasons(bold)
    assert "takes a chance" not in reasons(
        [a_line("collision_aware_paper", "severe_occlusion", 1.0, 0.0)]
    )


def test_a_policy_with_one_seed_is_said_to_be_one_example() -> None:
    one = a_line("tuned", "base", 1.0, 0.0, training_seed=0)
    other = a_line("tuned", "base", 1.0, 0.0, training_seed=1, policy_hash="other")
    assert "tuned should be taken as one example" in reasons([one])
    assert "tuned 2." in reasons([one, other])
    assert "one example" not in reasons([one, other])


def test_the_curiosities_hold_the_papers_numbers_and_ours_beside() -> None:
    line = a_line("rule_based", "base", 0.0, 0.0, sensor_range_m=40.0, mean_speed_mps=speed(0.55))
    text = curiosities([line])
    for words in ("from 2.16 to 1.25 m/s", "0.0 m/s at 40 m", "steps of 0.1", "-200 and +100"):
        assert words in text
    assert "Here: 0.55 m/s with respawning traffic." in text
    assert "Here" not in curiosities([])
