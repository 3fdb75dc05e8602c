# SPDX-License-Identifier: Apache-2.0
"""What goes from the situation to the decision: a situation with its time, or the fault."""

from dataclasses import dataclass
from typing import NamedTuple

from risk_dqn_planner.errors import PlannerError
from risk_dqn_planner.faults import FaultyInput, Status
from risk_dqn_planner.situation.situations import Situations

__all__ = ["Fault", "FaultyInput", "SituationReport", "Status", "fault_of"]


class Fault(NamedTuple):
    """Why there is no situation: its time [ns], its kind, what is at fault, and one sentence."""

    stamp_ns: int
    status: Status
    source: FaultyInput
    text: str


@dataclass(frozen=True)
class SituationReport:
    """The situation at one time (a batch of one), or why there is none.

    stamp_ns: time of the perceived objects; of the report itself where there is a fault [ns].
    text: one sentence on the fault, empty when OK. situations: None exactly if there is a fault.
    source: what is at fault, NO_INPUT when OK. route_stamp_ns: of the route's message; another
    one, or another route, is a new errand.
    """

    stamp_ns: int
    status: Status
    text: str
    route: tuple[int, ...] = ()
    stop_line_derived: bool = False
    situations: Situations | None = None
    source: FaultyInput = FaultyInput.NO_INPUT
    route_stamp_ns: int = 0


def fault_of(stamp_ns: int, error: PlannerError) -> Fault:
    """Return the fault that an error tells of."""
    return Fault(stamp_ns, error.kind, error.source, str(error))
