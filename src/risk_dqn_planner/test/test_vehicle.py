# SPDX-License-Identifier: Apache-2.0
"""No configuration takes what would make the joint check believe in an impossible vehicle."""

import dataclasses
import math
from typing import Any

import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.policies.look_ahead import LookAheadConfig
from risk_dqn_planner.policies.outlook import OutlookConfig
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.config import SituationConfig, TrackingConfig
from risk_dqn_planner.situation.limits import PlausibilityLimits
from risk_dqn_planner.state.encoding import StateConfig
from risk_dqn_planner.vehicle import EgoLimits, TrafficLimits, VehicleDimensions

CONFIGURATIONS: list[type[Any]] = [
    EgoLimits,
    IntersectionConfig,
    LookAheadConfig,
    OutlookConfig,
    PlausibilityLimits,
    RiskConfig,
    RuleBasedConfig,
    SafetyAssumptions,
    SituationConfig,
    StateConfig,
    TrackingConfig,
    TrafficLimits,
    VehicleDimensions,
]
NUMBERS = [
    pytest.param(configuration, item.name, id=f"{configuration.__name__}.{item.name}")
    for configuration in CONFIGURATIONS
    for item in dataclasses.fields(configuration)
    if isinstance(item.default, float)
]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -1.0])
@pytest.mark.parametrize(("configuration", "name"), NUMBERS)
def test_numbers_that_make_no_sense_are_refused_by_name(
    configuration: type[Any], name: str, value: float
) -> None:
    with pytest.raises(ConfigurationError, match=rf"{configuration.__name__}\.{name} is {value}"):
        configuration(**{name: value})


@pytest.mark.parametrize(
    ("name", "value"), [("acceleration_mps2", 1e6), ("braking_mps2", 1e6), ("fast_mps", 1e6)]
)
def test_no_ego_speeds_up_brakes_or_drives_like_nothing_on_a_road(name: str, value: float) -> None:
    with pytest.raises(ConfigurationError, match=rf"EgoLimits\.{name} is .*, expected 0\.01 to"):
        EgoLimits(**{name: value})
