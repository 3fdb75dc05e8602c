# SPDX-License-Identifier: Apache-2.0
"""Between explanations and their messages, which lie within decisions."""

import math

import numpy as np
from intersection_msgs.msg import Explanation as ExplanationMessage

from risk_dqn_planner.explanation.fields import Critical, Explanation, Verdict
from risk_dqn_planner.policies.base import Action

_NUMBERS = (
    "distance_m", "speed_mps", "reach_s", "leave_s", "gap_wanted_s", "lacking_s", "ahead_m",
    "ego_speed_mps", "ego_distance_m", "stop_line_distance_m",
)  # fmt: skip


def explanation_to_message(explanation: Explanation) -> ExplanationMessage:
    """Return an explanation as the part of a decision's message."""
    considered = explanation.considered
    return ExplanationMessage(
        considered=ExplanationMessage.NO_ACTION if considered is None else int(considered),
        verdict=int(explanation.verdict),
        critical=int(explanation.critical),
        hidden=explanation.hidden,
        merging=explanation.merging,
        margins_s=np.array(explanation.margins_s, dtype=np.float64),
        **{name: float(getattr(explanation, name)) for name in _NUMBERS},
    )


def explanation_from_message(message: ExplanationMessage) -> Explanation:
    """Return the explanation.

    Raises:
        ValueError: unknown action, verdict or place of the critical vehicle.
    """
    nobody = message.considered == ExplanationMessage.NO_ACTION
    stop, slow, fast = (_number(margin_s) for margin_s in message.margins_s)
    return Explanation(
        considered=None if nobody else Action(message.considered),
        verdict=Verdict(message.verdict),
        critical=Critical(message.critical),
        hidden=message.hidden,
        merging=message.merging,
        margins_s=(stop, slow, fast),
        **{name: _number(getattr(message, name)) for name in _NUMBERS},
    )


def _number(value: float) -> float:
    """Return the one NaN that explanations use for what does not apply, so that they compare."""
    return math.nan if math.isnan(value) else float(value)
