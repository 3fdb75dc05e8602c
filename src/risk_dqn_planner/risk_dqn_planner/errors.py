# SPDX-License-Identifier: Apache-2.0
"""Named errors: each says what is wrong, which input it is, and what was expected.

Commands and nodes catch `PlannerError` and print its one sentence; anything else is a bug.
"""

from risk_dqn_planner.faults import FaultyInput, Status


class PlannerError(Exception):
    """Base of every error that a user's input or surroundings can cause.

    kind and source name the fault for programs, as the sentence does for people.
    """

    kind = Status.INTERNAL_ERROR
    source = FaultyInput.NO_INPUT

    def __init__(
        self, text: str = "", kind: Status | None = None, source: FaultyInput | None = None
    ) -> None:
        """Say what is wrong; kind and source are by default those of the class."""
        super().__init__(text)
        if kind is not None:
            self.kind = kind
        if source is not None:
            self.source = source


class ConfigurationError(PlannerError):
    """A parameter is out of its range or contradicts another one."""

    kind, source = Status.NOT_CONFIGURED, FaultyInput.PARAMETERS


class MapError(PlannerError):
    """A Lanelet2 map cannot be used."""

    kind, source = Status.NOT_CONFIGURED, FaultyInput.MAP


class MapFileError(MapError):
    """The map file is missing, unreadable or not a Lanelet2 map."""


class MapProjectionError(MapError):
    """The map does not lie where its projector's origin says."""


class RouteError(PlannerError):
    """A route cannot be followed on its map."""

    kind, source = Status.BAD_ROUTE, FaultyInput.ROUTE


class UnknownLaneletError(RouteError):
    """The route names a lanelet that is not on the map."""


class DisconnectedRouteError(RouteError):
    """Two consecutive lanelets of the route are not connected in driving direction."""


class NoConflictError(RouteError):
    """The route meets no intersecting lane, so there is nothing to decide."""


class EgoPoseError(PlannerError):
    """The ego is off its route."""

    kind, source = Status.OFF_ROUTE, FaultyInput.ODOMETRY


class WrongWayError(EgoPoseError):
    """The ego faces the wrong way."""

    kind = Status.WRONG_WAY


class InputError(PlannerError):
    """A perceived quantity is not finite, not plausible or in the wrong frame."""

    kind = Status.MALFORMED_INPUT


class PolicyError(PlannerError):
    """A policy cannot be used."""

    source = FaultyInput.POLICY


class UnknownPolicyError(PolicyError):
    """No policy has the given name."""


class PolicyFileError(PolicyError):
    """A policy file is missing, damaged, or breaks its contract."""


class ScenarioError(PlannerError):
    """A scenario is unknown or cannot be laid out on the given map."""


class BagError(PlannerError):
    """A recorded bag is missing, unreadable or lacks a needed topic."""
