# SPDX-License-Identifier: Apache-2.0
"""What a network is told beyond the paper's state: what is sound, and what waiting would bring.

    action in force | sound actions | margins of going on after each action | next place
    3, one is 1     | 3, 0 or 1     | 3                                     | 4

    forecast | is it enough? | creeping | way left after each action | what of it hops cannot fill
    5 x K    | 5 x K, 0 or 1 | 0 or 1   | 3                          | 3

The margins are the joint check's, if the ego goes on after the action, through everything or to a
rest beyond the next place: there is no other way to join a lane behind a leader. The forecast is
that of going after k periods of waiting, in five ways. Which of these margins are enough is told
besides: hundredths of a second decide that, which a network hardly tells apart. The next place is
where the ego can wait: the way to the next zone, to the place, through the zones behind it, and
whether it joins a lane there. Creeping is 1 where the ego will not see enough before it stands at
that place, so that decimetres matter: then the network has to choose hops that end there. The same
object serves a batch in training and a batch of one on the vehicle; rows are independent.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import allocating_kernel, kernel
from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.foresight.creeping import FAR_M, short_of
from risk_dqn_planner.policies.foresight.forecast import (
    WAYS_TO_WAIT,
    Place,
    forecast,
    next_place,
    rests_at,
)
from risk_dqn_planner.policies.foresight.sight import SightLines
from risk_dqn_planner.policies.foresight.task import (
    SearchNumbers,
    Task,
    Work,
    work_fit_for,
    work_for,
)
from risk_dqn_planner.safety.assumptions import SafetyAssumptions, SafetyNumbers
from risk_dqn_planner.safety.course import begin_course
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.safety.joint_check import (
    ACTIONS,
    JointCheck,
    foresee,
    go_on,
    is_enough,
    target_of,
)
from risk_dqn_planner.safety.known import Known
from risk_dqn_planner.situation.situations import Booleans, Floats, Integers, Situations

Inputs = NDArray[np.float32]

_ROUNDING = 1e-6

LAYOUT = (
    "action in force (3), sound (3), margins of going (3), next place (free, rest, zones, joins), "
    "margins of going after k periods of (Stop, Slow, coming nearer, that after a period of Stop, "
    "of Slow), also to a rest beyond that place, which of them are enough, creeping, "
    "way left after each action (3), shortfall after each action (3)"
)
_IN_FORCE, _SOUND, _GOING, _PLACE = 0, ACTIONS, 2 * ACTIONS, 3 * ACTIONS
_LATER = _PLACE + 4
_CREEPING = 1 + 2 * ACTIONS
# A shortfall is below the shortest hop, which is about this.
_MOST_SHORT_M = 0.3


@dataclass(frozen=True)
class OutlookConfig:
    """periods: K, how many decisions the forecast looks ahead.

    most_s: margins are divided by it, and cut off at -1 and 1. most_m: the same for ways, of
    which the root is taken, and through zones for half of it. nearest_corner_m: what hides a
    lane ends at least this far before its centreline, as in the look-ahead search.
    """

    periods: int = 8
    most_s: float = 4.0
    most_m: float = 40.0
    nearest_corner_m: float = 2.0

    def __post_init__(self) -> None:
        if self.periods < 1:
            raise ConfigurationError(f"OutlookConfig.periods is {self.periods}, expected 1 or more")
        for name in ("most_s", "most_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ConfigurationError(
                    f"OutlookConfig.{name} is {getattr(self, name)}, "
                    "expected a finite number above 0"
                )
        if not 0.0 <= self.nearest_corner_m < math.inf:
            raise ConfigurationError(
                f"OutlookConfig.nearest_corner_m is {self.nearest_corner_m}, "
                "expected a finite number, 0 or more"
            )

    @property
    def size(self) -> int:
        """How many numbers there are for each situation."""
        return _LATER + 2 * WAYS_TO_WAIT * self.periods + _CREEPING


class Views(NamedTuple):
    """What one look at B situations found.

    inputs (B, E): for the network. sound (B, 3); check: the joint check. in_force (B,): the action
    before; known, corner_m (B, M): as the look-ahead search takes them.
    """

    inputs: Inputs
    sound: Booleans
    check: JointCheck
    in_force: Integers
    known: Known
    corner_m: Floats


class Outlook:
    """The joint check with its memory, and the forecast. Call `look`, choose, call `decided`."""

    def __init__(
        self, assumptions: SafetyAssumptions | None = None, config: OutlookConfig | None = None
    ) -> None:
        self.config = config or OutlookConfig()
        self._guard = Guard(assumptions)
        self._sight = SightLines(self.config.nearest_corner_m)
        self._work = work_for(_numbers(self.config), self.assumptions.numbers(), 0, 0)

    @property
    def assumptions(self) -> SafetyAssumptions:
        """What is called sound rests on them."""
        return self._guard.assumptions

    def look(self, situations: Situations, restart: Booleans) -> Views:
        """Look at B situations; `restart` (B,) marks where what was seen before is void."""
        check = self._guard.look(situations, restart)
        p, c = self.assumptions.numbers(), _numbers(self.config)
        self._work = work_fit_for(self._work, c, p, situations)
        views = Views(
            inputs=np.empty((len(restart), self.config.size), dtype=np.float32),
            sound=self._guard.sound(check),
            check=check,
            in_force=self._guard.in_force,
            known=self._guard.known,
            corner_m=self._sight.corner_m(situations, restart),
        )
        look_into(
            situations,
            p,
            c,
            self.config.most_s,
            self.config.most_m,
            views.known,
            views.corner_m,
            views.sound,
            views.in_force,
            self._work,
            views.inputs,
        )
        return views

    def decided(self, views: Views, action: Integers) -> None:
        """Take note of the actions (B,) that will be carried out."""
        self._guard.decided(views.check, action)


def _numbers(config: OutlookConfig) -> SearchNumbers:
    """Return as many decisions as the forecast has; nothing is searched, so the rest is idle."""
    return SearchNumbers(
        decisions=config.periods + 1, cell_m=1.0, cell_mps=1.0, switching_s=0.0, gap_price=0.0
    )


@allocating_kernel
def look_into(
    s: Situations,
    p: SafetyNumbers,
    c: SearchNumbers,
    most_s: float,
    most_m: float,
    known: Known,
    corner_m: Floats,
    sound: Booleans,
    in_force: Integers,
    w: Work,
    inputs: Inputs,
) -> None:
    """Fill the inputs (B, E) row by row."""
    lanes, periods = s.lane_mask.shape[1], c.decisions - 1
    arrival_s, who = np.empty(lanes), np.empty(lanes, dtype=np.int64)
    later_s, ego = np.empty((WAYS_TO_WAIT, periods)), np.empty((WAYS_TO_WAIT, 3))
    for row in range(s.ego_speed_mps.shape[0]):
        last_m, merging = foresee(s, row, known, p, arrival_s, who)
        t = Task(s, row, p, c, known, corner_m, sound, in_force)
        place = next_place(t, w)
        now_mps = max(s.ego_speed_mps[row], 0.0)
        before_mps = target_of(in_force[row], p)
        for action in range(ACTIONS):
            course = begin_course(now_mps, before_mps, target_of(action, p), p)
            _, going = go_on(
                s, row, course, arrival_s, who, known, place.rest_m, last_m, merging, p
            )
            inputs[row, _IN_FORCE + action] = 1.0 if in_force[row] == action else 0.0
            inputs[row, _SOUND + action] = 1.0 if sound[row, action] else 0.0
            inputs[row, _GOING + action] = share_of(going.margin_s, most_s)
        tell_place(place, most_m, inputs[row, _PLACE:_LATER])
        forecast(t, place, periods, w, ego, later_s)
        tell_forecast(later_s, most_s, inputs[row, _LATER:])
        tell_hops(t, place, w, inputs[row, inputs.shape[1] - _CREEPING :])


@kernel
def share_of(margin_s: float, most_s: float) -> float:
    """Map a margin to [-1, 1]."""
    return max(-1.0, min(margin_s / most_s, 1.0))


@kernel
def tell_place(place: Place, most_m: float, inputs: Inputs) -> None:
    """Fill what the network is told of the next place (4,); 1, 1, 0, 0 where there is none."""
    inputs[0] = math.sqrt(min(max(place.free_m / most_m, 0.0), 1.0))
    inputs[1] = math.sqrt(min(place.rest_m / most_m, 1.0))
    inputs[2], inputs[3] = 0.0, 0.0
    if place.rest_m < math.inf:
        inputs[2] = min((place.clear_m - place.rest_m) / (0.5 * most_m), 1.0)
        inputs[3] = 1.0 if place.joins else 0.0


@kernel
def tell_forecast(later_s: Floats, most_s: float, inputs: Inputs) -> None:
    """Fill the margins (5, K) as shares, and behind them which are enough."""
    ways, periods = later_s.shape
    for wait in range(ways):
        for k in range(periods):
            at = wait * periods + k
            inputs[at] = share_of(later_s[wait, k], most_s)
            inputs[ways * periods + at] = 1.0 if is_enough(later_s[wait, k]) else 0.0


@kernel
def tell_hops(t: Task, place: Place, w: Work, inputs: Inputs) -> None:
    """Fill what the network is told of creeping to the next place (7,).

    Ways are told up to FAR_M; where nothing is to be crept to, or the ego would rest beyond it, a
    way is -1 and a shortfall 1.
    """
    inputs[0] = 1.0 if place.creeping else 0.0
    now_mps = max(t.s.ego_speed_mps[t.row], 0.0)
    for action in range(ACTIONS):
        left_m = place.rest_m - rests_at(0.0, now_mps, target_of(action, t.p), t.p)
        inputs[1 + action], inputs[1 + ACTIONS + action] = -1.0, 1.0
        if -_ROUNDING <= left_m < math.inf:
            short_m = short_of(w.shortfall_m, max(left_m, 0.0))
            inputs[1 + action] = min(left_m / FAR_M, 1.0)
            inputs[1 + ACTIONS + action] = min(short_m / _MOST_SHORT_M, 1.0)
