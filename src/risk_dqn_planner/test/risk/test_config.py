# SPDX-License-Identifier: Apache-2.0
import pytest

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.vehicle import VehicleDimensions


def test_defaults_are_the_papers() -> None:
    parameters = RiskConfig().parameters()
    assert (parameters.desired_gap_s, parameters.safe_gap_s) == (3.0, 0.1)
    assert parameters.stop_margin_m == 0.1
    assert (parameters.ego_acceleration_mps2, parameters.ego_fast_mps) == (1.5, 5.0)
    assert parameters.ego_braking_mps2 == 3.5
    assert parameters.traffic_acceleration_mps2 == 2.0


def test_a_leaders_centre_is_kept_a_length_and_the_margin_away() -> None:
    config = RiskConfig(leader_margin_m=2.0, vehicle=VehicleDimensions(length_m=5.0))
    assert config.parameters().leader_distance_m == 7.0


@pytest.mark.parametrize("name", ["stop_margin_m", "safe_gap_s", "leader_margin_m"])
def test_negative_and_missing_numbers_are_refused_by_name(name: str) -> None:
    for value in (-0.1, float("nan")):
        with pytest.raises(ConfigurationError, match=rf"RiskConfig\.{name} is"):
            RiskConfig(**{name: value})  # type: ignore[arg-type]


def test_the_desired_gap_must_exceed_the_safe_one() -> None:
    with pytest.raises(ConfigurationError, match=r"desired_gap_s is 0\.1"):
        RiskConfig(desired_gap_s=0.1)
