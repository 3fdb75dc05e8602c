# SPDX-License-Identifier: Apache-2.0
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.state.encoding import (
    StateConfig,
    criticality,
    encode_distance,
    encode_speed,
)


@pytest.mark.parametrize(
    ("distance", "expected"),
    [
        (0.0, 0.0),
        (17.5, 0.5),  # a quarter of 70 m
        (-17.5, -0.5),
        (70.0, 1.0),
        (100.0, 1.0),
        (-100.0, -1.0),
        (math.inf, 1.0),
    ],
)
def test_distances_map_through_a_signed_root(distance: float, expected: float) -> None:
    assert encode_distance(distance, 70.0) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("speed", "expected"), [(0.0, 0.0), (7.5, 0.5), (-3.0, -0.2), (30.0, 1.0), (-30.0, -1.0)]
)
def test_speeds_map_linearly(speed: float, expected: float) -> None:
    assert encode_speed(speed, 15.0) == pytest.approx(expected)


@given(st.floats(-1e9, 1e9), st.floats(0.1, 1000.0))
def test_encodings_stay_within_one(value: float, maximum: float) -> None:
    assert -1.0 <= encode_distance(value, maximum) <= 1.0
    assert -1.0 <= encode_speed(value, maximum) <= 1.0


def test_criticality_is_the_papers() -> None:
    assert criticality(0.0, 0.0) == 1.0
    assert criticality(1.0, 1.0) == pytest.approx(0.0)
    assert criticality(0.6, 0.8) == pytest.approx(1.0 - 1.0 / math.sqrt(2.0))
    assert criticality(-0.6, 0.8) == criticality(0.6, 0.8)


def test_encodings_broadcast() -> None:
    np.testing.assert_allclose(encode_distance(np.array([17.5, 70.0]), 70.0), [0.5, 1.0])


@pytest.mark.parametrize("value", [0.0, -1.0, math.inf, math.nan])
def test_a_maximum_must_be_finite_and_positive(value: float) -> None:
    fields: dict[str, Any] = {"hidden_max_m": value}
    with pytest.raises(ConfigurationError, match=r"StateConfig\.hidden_max_m is"):
        StateConfig(**fields)
