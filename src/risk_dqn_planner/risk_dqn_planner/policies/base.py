# SPDX-License-Identifier: Apache-2.0
"""What every policy is: situations in, actions with their reasons out, for a whole batch."""

import enum
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.faults import Status
from risk_dqn_planner.safety.joint_check import JointCheck
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations


class Action(enum.IntEnum):
    """High-level actions of the paper, ordered by speed ("Action Space")."""

    STOP = 0
    SLOW = 1
    FAST = 2


class Reason(enum.IntEnum):
    """Why an action was chosen; the codes are those of intersection_msgs/Decision.

    Faults are those of Status, with the same names and codes, and the policy's own; with any of
    them the action is Stop.
    """

    CLEAR = 0  # nothing conflicts
    VEHICLE = 1  # a perceived vehicle decides
    HIDDEN_VEHICLE = 2  # a vehicle that may hide in an occluded lane decides
    LEARNED = 3  # highest value of a trained network
    GOAL_REACHED = 4
    FIXED = 5  # the policy decides so whatever the situation
    MISSING_INPUT = Status.MISSING_INPUT.value
    STALE_INPUT = Status.STALE_INPUT.value
    FUTURE_INPUT = Status.FUTURE_INPUT.value
    OUT_OF_ORDER_INPUT = Status.OUT_OF_ORDER_INPUT.value
    FROZEN_INPUT = Status.FROZEN_INPUT.value
    WRONG_FRAME = Status.WRONG_FRAME.value
    NOT_FINITE = Status.NOT_FINITE.value
    IMPLAUSIBLE_SPEED = Status.IMPLAUSIBLE_SPEED.value
    IMPLAUSIBLE_JUMP = Status.IMPLAUSIBLE_JUMP.value
    DUPLICATE_ID = Status.DUPLICATE_ID.value
    INVALID_VISIBLE_AREA = Status.INVALID_VISIBLE_AREA.value
    INVALID_SIZE = Status.INVALID_SIZE.value
    MALFORMED_INPUT = Status.MALFORMED_INPUT.value
    BAD_ROUTE = Status.BAD_ROUTE.value
    OFF_ROUTE = Status.OFF_ROUTE.value
    WRONG_WAY = Status.WRONG_WAY.value
    NOT_CONFIGURED = Status.NOT_CONFIGURED.value
    INTERNAL_ERROR = Status.INTERNAL_ERROR.value
    POLICY_NOT_READY = 60  # it is still being loaded
    POLICY_REFUSED = 61  # it cannot or must not be used, see the text
    POLICY_FAILED = 62  # it could not be evaluated
    RECOVERING = 63  # all is good again, but not for long enough

    @property
    def is_fault(self) -> bool:
        """Whether no policy could decide; the action then is Stop."""
        return self >= Reason.MISSING_INPUT


class Supervision(enum.IntEnum):
    """What the supervisor says of a decision; the codes are those of intersection_msgs/Decision."""

    OFF = 0  # no supervisor ran
    AGREED = 1  # the policy's action is sound
    OBJECTED = 2  # it is not, and is carried out all the same
    OVERRULED = 3  # it is not, and a sound one stands in


class Decisions(NamedTuple):
    """Decisions for B situations.

    action (B,): Action. q_values (B, 3) and action_risks (B, 3): NaN where there are none; risks
    in [0, 1], 0 safe, 1 fully unsafe. reason (B,): Reason.
    critical_vehicle (B,): index into the N vehicle places, -1 none.
    critical_lane (B,): index into the M lanes, -1 none.
    supervision (B,): Supervision, and proposed (B,): the action before it was checked; None
    without a supervisor. lacking_s (B,): where the joint check forbids the next faster action, or
    the proposed one, the time that is missing; NaN where something else decided, None if all.
    check: what the joint check says, and in_force (B,): the action before, which it counts on;
    None where nobody checked.
    """

    action: NDArray[np.int64]
    q_values: Floats
    action_risks: Floats
    reason: Integers
    critical_vehicle: Integers
    critical_lane: Integers
    supervision: Integers | None = None
    proposed: Integers | None = None
    lacking_s: Floats | None = None
    check: JointCheck | None = None
    in_force: Integers | None = None


def bare_decisions(action: Integers, reason: Reason, q_values: Floats | None = None) -> Decisions:
    """Return decisions for actions (B,) that name nobody and know no risks.

    q_values (B, 3): None where there are none either.
    """
    unknown = np.full((len(action), len(Action)), np.nan)
    nobody = np.full(len(action), -1)
    return Decisions(
        action=action,
        q_values=unknown.copy() if q_values is None else q_values,
        action_risks=unknown,
        reason=np.full(len(action), reason, dtype=np.int64),
        critical_vehicle=nobody,
        critical_lane=nobody.copy(),
    )


class Policy(Protocol):
    """A policy may remember earlier situations; `restart` tells where that memory is void."""

    @property
    def name(self) -> str:
        """Name for logs and messages."""

    @property
    def hash(self) -> str:
        """SHA-256 of the policy's file, or of its configuration where it has no file."""

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide for each situation; `restart` (B,) marks a new episode or a gap in the input."""


class StopsAtGoal:
    """Any policy, with Stop once the goal is passed: there is nothing left to decide there.

    Policies themselves need not think of it; `load_policy` puts this around each of them.
    """

    def __init__(self, policy: Policy) -> None:
        self.policy = policy

    @property
    def name(self) -> str:
        """Name of the policy inside."""
        return self.policy.name

    @property
    def hash(self) -> str:
        """SHA-256 of the policy inside."""
        return self.policy.hash

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide as the policy inside does before the goal, and Stop from there on."""
        decisions = self.policy.decide(situations, restart)
        at_goal = situations.goal_distance_m <= 0.0
        if not at_goal.any():
            return decisions
        return decisions._replace(
            action=np.where(at_goal, Action.STOP, decisions.action),
            reason=np.where(at_goal, Reason.GOAL_REACHED, decisions.reason),
            critical_vehicle=np.where(at_goal, -1, decisions.critical_vehicle),
            critical_lane=np.where(at_goal, -1, decisions.critical_lane),
        )
