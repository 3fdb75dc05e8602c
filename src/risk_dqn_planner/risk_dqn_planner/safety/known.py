# SPDX-License-Identifier: Apache-2.0
"""What the joint check knows of others beside the situation: learnt from decision to decision."""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.safety.assumptions import SafetyNumbers
from risk_dqn_planner.safety.speeds import measured
from risk_dqn_planner.situation.situations import Floats, Situations


class Known(NamedTuple):
    """Rows as in the situations.

    reacted_m (B, M): vehicles of merging lanes no further from their zone's centre than this have
    had the ego in their lane, and in sight, for the reaction time. low_mps, high_mps, likely_mps
    (B, N): speeds, as in `Speeds`.
    """

    reacted_m: Floats
    low_mps: Floats
    high_mps: Floats
    likely_mps: Floats


def at_first_sight(situations: Situations, p: SafetyNumbers) -> Known:
    """Return what is known without a memory: nobody has reacted, speeds are as measured."""
    return Known(np.full(situations.lane_mask.shape, -np.inf), *measured(situations, p))
