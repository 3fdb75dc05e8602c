# SPDX-License-Identifier: Apache-2.0
"""The numbers of an explanation, as in intersection_msgs/Explanation."""

import enum
import math
from typing import NamedTuple

from risk_dqn_planner.policies.base import Action

NAN = math.nan


class Verdict(enum.IntEnum):
    """What holds of the action that is considered."""

    NOT_ASKED = 0  # nothing conflicts, or the decision has another reason
    LEAVES_IN_TIME = 1  # the ego has left the zone before anyone comes, or merges with room
    STOPS_IN_TIME = 2  # the ego can still stop before the zone
    TOO_LATE = 3  # the ego can neither stop before the zone nor leave it in time
    TOO_CLOSE = 4  # the ego could not stop behind the vehicle ahead
    NO_WAY_OUT = 5  # no manoeuvre would be left that is safe against everyone at once
    KEEPS_BACK = 6  # it would be safe, but waiting further back pays


class Critical(enum.IntEnum):
    """Where the vehicle is that matters most, seen or hidden."""

    NOBODY = 0
    APPROACHING = 1  # on the way to the conflict zone
    IN_ZONE = 2  # in the conflict zone
    AHEAD = 3  # in the ego's own lane, ahead of it
    BEHIND = 4  # in the ego's own lane, behind it


class Explanation(NamedTuple):
    """Whom a decision turns on, when that one comes, and when the ego is gone; NaN: not applicable.

    Times count from the situation's stamp and are the worst case: others accelerate up to their
    limits, the ego carries out `considered` first and goes then.
    considered: the faster action that was not taken; where there is none, or it is the
    supervisor's, the one proposed. None where none was weighed.
    hidden: the critical vehicle is not seen, but may be at the nearest hidden place of its lane.
    merging: its lane joins the ego's, otherwise it crosses.
    distance_m: from it to the centre of the conflict zone, negative once passed. speed_mps: its
    speed, the lane's limit where it is hidden.
    reach_s: until it reaches the zone, 0 inside. leave_s: until the ego has left the zone.
    gap_wanted_s: least time wanted between both. lacking_s: what the gap lacks, negative to spare;
    on merging lanes room counts as time. ahead_m: how far it is ahead, between centres,
    negative behind.
    margins_s: by Action, what the check of soundness leaves, negative what lacks.
    ego_distance_m: from the ego to the centre of that zone. stop_line_distance_m: from its front.
    """

    considered: Action | None = None
    verdict: Verdict = Verdict.NOT_ASKED
    critical: Critical = Critical.NOBODY
    hidden: bool = False
    merging: bool = False
    distance_m: float = NAN
    speed_mps: float = NAN
    reach_s: float = NAN
    leave_s: float = NAN
    gap_wanted_s: float = NAN
    lacking_s: float = NAN
    ahead_m: float = NAN
    margins_s: tuple[float, float, float] = (NAN, NAN, NAN)
    ego_speed_mps: float = NAN
    ego_distance_m: float = NAN
    stop_line_distance_m: float = NAN

    @property
    def no_action_is_sound(self) -> bool:
        """Whether the check admits none, so that the manoeuvre verified last is carried on."""
        return all(margin_s < 0.0 for margin_s in self.margins_s)


NOTHING_EXPLAINED = Explanation()
