# SPDX-License-Identifier: Apache-2.0
"""What goes from the situation to the decision: a situation with its time, or the fault."""

import enum
from dataclasses import dataclass

from risk_dqn_planner.errors import EgoPoseError, InputError, PlannerError, RouteError
from risk_dqn_planner.situation.situations import Situations


class Status(enum.IntEnum):
    """Whether there is a situation; the codes are those of intersection_msgs/Situation."""

    OK = 0
    MISSING_INPUT = 1  # an input has never arrived
    STALE_INPUT = 2  # an input is older than allowed
    INVALID_INPUT = 3  # an input is not finite, not plausible or in the wrong frame
    BAD_ROUTE = 4  # the route does not fit the map
    OFF_ROUTE = 5  # the ego is beside its route or faces the wrong way


@dataclass(frozen=True)
class SituationReport:
    """The situation at one time (a batch of one), or why there is none.

    stamp_ns: time of the perceived objects; of the report itself where there is a fault [ns].
    text: one sentence on the fault, empty when OK. situations: None exactly if there is a fault.
    """

    stamp_ns: int
    status: Status
    text: str
    route: tuple[int, ...] = ()
    stop_line_derived: bool = False
    situations: Situations | None = None


def fault_status(error: PlannerError) -> Status:
    """Return the status that stands for an error."""
    if isinstance(error, EgoPoseError):
        return Status.OFF_ROUTE
    if isinstance(error, RouteError):
        return Status.BAD_ROUTE
    if isinstance(error, InputError):
        return Status.INVALID_INPUT
    raise error
