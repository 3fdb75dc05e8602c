# SPDX-License-Identifier: Apache-2.0
"""Short hops towards a line: what is left when none fits any more."""

import pytest

from risk_dqn_planner.policies.foresight.creeping import short_of, shortfalls
from risk_dqn_planner.safety.assumptions import SafetyAssumptions

SHORTFALL_M = shortfalls(SafetyAssumptions().numbers())


@pytest.mark.parametrize(
    ("left_m", "short_m"),
    [
        (0.0, 0.0),
        # Half a second at 1.5 m/s^2 is 0.188 m, braking from 0.75 m/s takes 0.080 m.
        (0.25, 0.25),
        (0.27, 0.0),
        (0.40, 0.13),
        # Two hops; two periods of Fast, 0.75 m and 0.32 m.
        (0.54, 0.0),
        (1.075, 0.0),
        # Far enough away every place can be reached, and behind it nothing can be mended.
        (9.0, 0.0),
        (-0.1, 0.0),
    ],
)
def test_what_is_left_is_what_no_hops_fill(left_m: float, short_m: float) -> None:
    assert short_of(SHORTFALL_M, left_m + 1e-9) == pytest.approx(short_m, abs=0.006)


def test_from_further_away_the_ego_comes_nearer_than_a_hop() -> None:
    # Grains of 5 mm: within a metre, and beyond two and a half.
    assert SHORTFALL_M[:200].max() > 0.2
    assert SHORTFALL_M[500:].max() < 0.05
