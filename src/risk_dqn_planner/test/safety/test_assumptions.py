# SPDX-License-Identifier: Apache-2.0
import dataclasses
import math
from typing import Any

import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.safety.assumptions import SafetyAssumptions


def test_every_parameter_says_what_it_is_and_its_default_lies_within_its_bounds() -> None:
    for field in dataclasses.fields(SafetyAssumptions):
        if field.default is dataclasses.MISSING:
            continue
        assert field.metadata["description"].endswith("]") or field.name.endswith("_factor")
        assert field.metadata["minimum"] <= field.default <= field.metadata["maximum"]


def test_every_number_reaches_the_kernels() -> None:
    plain = SafetyAssumptions(actuation_delay_s=0.3)
    bounded_by_others = {
        "decision_period_s": 1.0,
        "actuation_delay_s": 0.5,
        "actuation_jitter_s": 0.1,
        "ego_braking_factor": 1.5,
    }
    for field in dataclasses.fields(SafetyAssumptions):
        if field.default is not dataclasses.MISSING:
            low, high = field.metadata["minimum"], field.metadata["maximum"]
            other = bounded_by_others.get(field.name, low if field.default == high else high)
            changed = dataclasses.replace(plain, **{field.name: other})
            assert changed.numbers() != plain.numbers(), field.name


@pytest.mark.parametrize(
    "changes",
    [
        {"decision_period_s": 0.0},
        {"safe_gap_s": -0.1},
        {"safe_gap_s": 1e9},
        {"speed_error_mps": math.nan},
        {"follower_braking_mps2": math.inf},
    ],
)
def test_values_out_of_bounds_are_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(changes))):
        SafetyAssumptions(**changes)


def test_leaders_must_be_able_to_brake_as_hard_as_the_ego_ever_does() -> None:
    with pytest.raises(ConfigurationError, match=r"leader_braking_mps2 is 8\.0.*10\.5"):
        SafetyAssumptions(ego_braking_factor=3.0)
    with pytest.raises(ConfigurationError, match=r"leader_braking_mps2 is 3\.0.*3\.5"):
        SafetyAssumptions(leader_braking_mps2=3.0)


@pytest.mark.parametrize(("delay_s", "jitter_s"), [(0.0, 0.1), (0.2, 0.3)])
def test_jitter_is_part_of_the_delay(delay_s: float, jitter_s: float) -> None:
    with pytest.raises(ConfigurationError, match="actuation_jitter_s is"):
        SafetyAssumptions(actuation_delay_s=delay_s, actuation_jitter_s=jitter_s)


def test_only_one_decision_may_be_on_its_way() -> None:
    with pytest.raises(ConfigurationError, match=r"actuation_delay_s is 0\.6.*\(0\.5\)"):
        SafetyAssumptions(actuation_delay_s=0.6)
    SafetyAssumptions(actuation_delay_s=0.5)
