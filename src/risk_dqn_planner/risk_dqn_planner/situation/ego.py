# SPDX-License-Identifier: Apache-2.0
"""How far the ego is along its route."""

import math

from risk_dqn_planner.errors import EgoPoseError, WrongWayError
from risk_dqn_planner.intersection.model import IntersectionModel
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.inputs import EgoPose
from risk_dqn_planner.situation.matching import turned_by_kernel


def ego_progress(model: IntersectionModel, ego: EgoPose, config: SituationConfig) -> float:
    """Return the ego's arc length on its path [m].

    Raises:
        EgoPoseError: the ego is beside its path, before it or beyond its end.
        WrongWayError: it faces the wrong way.
    """
    path = model.ego_path.centerline
    limit = config.max_ego_heading_difference_rad
    s, lateral, heading = path.project(ego.x_m, ego.y_m, ego.heading_rad, limit)
    # With its heading ignored the ego may well be on the path: then it only faces the wrong way.
    nearest = path.project(ego.x_m, ego.y_m)
    # Written so that not-a-number, which huge coordinates lead to, is off the route.
    if not abs(nearest.lateral_m) <= config.max_ego_offset_m:
        raise EgoPoseError(
            f"the ego is {_metres(abs(nearest.lateral_m))} beside its route, "
            f"expected at most {config.max_ego_offset_m:g} m"
        )
    if nearest.s < 0.0:
        raise EgoPoseError(f"the ego is {_metres(-nearest.s)} before the start of its route")
    if nearest.s > path.length_m:
        beyond = nearest.s - path.length_m
        raise EgoPoseError(f"the ego is {_metres(beyond)} beyond the end of its route")
    if abs(lateral) > config.max_ego_offset_m:
        heading = nearest.heading_rad
    turned = turned_by_kernel(ego.heading_rad, heading)
    if turned > limit:
        raise WrongWayError(
            f"the ego is turned {math.degrees(turned):.0f} degrees away from its route, "
            f"expected at most {math.degrees(limit):.0f}"
        )
    return s


def between(first: EgoPose, second: EgoPose, share: float) -> EgoPose:
    """Return the ego a share of the time from one pose to another, 0 to 1: all changes linear."""
    turn = second.heading_rad - first.heading_rad
    turn = math.atan2(math.sin(turn), math.cos(turn))
    return EgoPose(
        first.x_m + share * (second.x_m - first.x_m),
        first.y_m + share * (second.y_m - first.y_m),
        first.heading_rad + share * turn,
        first.speed_mps + share * (second.speed_mps - first.speed_mps),
    )


def carried_on(ego: EgoPose, time_s: float) -> EgoPose:
    """Return the ego a time later, or earlier if it is below 0: straight on at its speed."""
    way_m = ego.speed_mps * time_s
    return ego._replace(
        x_m=ego.x_m + way_m * math.cos(ego.heading_rad),
        y_m=ego.y_m + way_m * math.sin(ego.heading_rad),
    )


def _metres(length_m: float) -> str:
    return f"{length_m:.1f} m" if length_m < 1e6 else f"{length_m:.1e} m"
