# SPDX-License-Identifier: Apache-2.0
"""Named errors: each says what is wrong, which input it is, and what was expected.

Commands and nodes catch `PlannerError` and print its one sentence; anything else is a bug.
"""


class PlannerError(Exception):
    """Base of every error that a user's input or surroundings can cause."""


class ConfigurationError(PlannerError):
    """A parameter is out of its range or contradicts another one."""


class MapError(PlannerError):
    """A Lanelet2 map cannot be used."""


class MapFileError(MapError):
    """The map file is missing, unreadable or not a Lanelet2 map."""


class MapProjectionError(MapError):
    """The map does not lie where its projector's origin says."""


class RouteError(PlannerError):
    """A route cannot be followed on its map."""


class UnknownLaneletError(RouteError):
    """The route names a lanelet that is not on the map."""


class DisconnectedRouteError(RouteError):
    """Two consecutive lanelets of the route are not connected in driving direction."""


class NoConflictError(RouteError):
    """The route meets no intersecting lane, so there is nothing to decide."""


class EgoPoseError(PlannerError):
    """The ego is off its route or faces the wrong way."""


class InputError(PlannerError):
    """A perceived quantity is not finite, not plausible or in the wrong frame."""


class PolicyError(PlannerError):
    """A policy cannot be used."""


class UnknownPolicyError(PolicyError):
    """No policy has the given name."""


class PolicyFileError(PolicyError):
    """A policy file is missing, damaged, or breaks its contract."""


class ScenarioError(PlannerError):
    """A scenario is unknown or cannot be laid out on the given map."""


class BagError(PlannerError):
    """A recorded bag is missing, unreadable or lacks a needed topic."""
