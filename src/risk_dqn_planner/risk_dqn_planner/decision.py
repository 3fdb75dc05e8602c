# SPDX-License-Identifier: Apache-2.0
"""What a policy decides and why, in the words that go out on the vehicle."""

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


class Action(enum.IntEnum):
    """High-level actions of the paper, ordered by speed ("Action Space")."""

    STOP = 0
    SLOW = 1
    FAST = 2


class Reason(enum.IntEnum):
    """Why an action was chosen; the codes are those of intersection_msgs/Decision."""

    CLEAR = 0  # nothing conflicts
    VEHICLE = 1  # a perceived vehicle decides
    HIDDEN_VEHICLE = 2  # a vehicle that may hide in an occluded lane decides
    LEARNED = 3  # highest value of a trained network
    GOAL_REACHED = 4
    NO_SITUATION = 10  # nothing received yet
    STALE_SITUATION = 11
    INVALID_SITUATION = 12  # the situation node reports a fault, see the text
    POLICY_FAILED = 13  # the policy could not be evaluated


@dataclass(frozen=True)
class Decision:
    """One decision with its reasons, as published (SPEC 7).

    q_values and action_risks are (3,) by Action, NaN where the policy has none; a risk is in
    [0, 1], 0 safe, 1 fully unsafe, the negated R_risk of the paper after the action.
    critical_vehicle_id and critical_lane_id name what decided; None where nothing did.
    """

    action: Action
    target_speed_mps: float
    reason: Reason
    text: str
    q_values: NDArray[np.float64]
    action_risks: NDArray[np.float64]
    critical_vehicle_id: int | None
    critical_lane_id: int | None
    policy_name: str
    policy_hash: str
