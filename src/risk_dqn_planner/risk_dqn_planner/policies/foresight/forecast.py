# SPDX-License-Identifier: Apache-2.0
"""How much time there would be if the ego waited, or crept, for a while and then went (kernels).

In traffic that keeps its speed, for each of the coming decisions. Nothing is searched and nothing
is chosen: the plans are always the same ones, and their margins are numbers for a network.
"""

from risk_dqn_planner.compiled import kernel
from risk_dqn_planner.policies.foresight.prediction import look_from, predict
from risk_dqn_planner.policies.foresight.task import Task, Work
from risk_dqn_planner.risk.motion import distance_after, speed_after
from risk_dqn_planner.safety.course import begin_course
from risk_dqn_planner.safety.joint_check import judge, target_of
from risk_dqn_planner.situation.situations import Floats

# What the ego may do before it goes: Stop and Slow.
WAYS_TO_WAIT = 2


@kernel
def forecast(t: Task, periods: int, w: Work, margin_s: Floats) -> None:
    """Fill the margins (2, K) of going after k + 1 periods of Stop, and of Slow.

    A margin is the one of the joint check [s], in the situation predicted for then.
    """
    p, now_mps = t.p, max(t.s.ego_speed_mps[t.row], 0.0)
    for k in range(1, periods + 1):
        predict(t, k, w)
        time_s = k * p.period_s
        for action in range(WAYS_TO_WAIT):
            target_mps = target_of(action, p)
            way_m = distance_after(time_s, now_mps, target_mps, p.ego_up_mps2, p.ego_down_mps2)
            mps = speed_after(time_s, now_mps, target_mps, p.ego_up_mps2, p.ego_down_mps2)
            look_from(t, k, way_m, w)
            course = begin_course(mps, target_mps, p.fast_mps, p)
            verdict = judge(w.ahead, k, course, w.arrival_s, w.who, w.reacted_m, p)
            margin_s[action, k - 1] = verdict.margin_s
