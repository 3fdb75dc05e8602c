# SPDX-License-Identifier: Apache-2.0
"""What is odd in the paper itself, named so that nobody looks for the fault elsewhere."""

from collections.abc import Sequence

from sim_bridge.evaluation.cells import RANGES_M, TRAFFIC
from sim_bridge.evaluation.reporting.markdown import NOTHING, as_speed, bare
from sim_bridge.evaluation.reporting.paper_values import (
    ACTION_USAGE,
    CHALLENGING,
    COLLISION_AWARE,
    MEAN_SPEED_MPS,
    RISK_AWARE,
    RULE_BASED,
)
from sim_bridge.evaluation.reporting.selection import Line
from sim_bridge.evaluation.reporting.verdicts import Evidence

_PAGE = """\
## Curiosities of the paper

- The rule-based policy's speed falls from {near:g} to {far:g} m/s as the sensor range *grows* from
  {near_m:g} to {far_m:g} m, although more sight should make Algorithm 1 bolder.{own_fall}
- It is {blind:.1f} m/s at {blind_m:g} m, although the ego must at least have driven to the stop
  line.{own_blind}
- Success rates come in steps of {step:g}, so each rests on 10 or 20 episodes. Wilson's 95% interval
  of 8 in 10 reaches from 49 to 94%: most differences between its bars are smaller than that.
- The text says that the collision-aware policy uses "higher stop actions" than both others; its
  figure has {collision_stop:g} of the rule's number, the rule 1 and the risk-aware one
  {risk_stop:g}. Both learned ones would have stopped six to eight times less than the rule, while
  driving fast as often as it.
- Collision and success are worth -200 and +100 in one place, -2 and +1 in another; training here
  takes the second pair, which stands where the baseline is defined.

How its misprints are read (the sign of t_gap, the missing break of Algorithm 1, an index) stands in
[paper.md](paper.md).
"""


def curiosities(lines: Sequence[Line]) -> str:
    """Return the chapter, with what was found here beside the oddities that can be driven."""
    rule = MEAN_SPEED_MPS[RULE_BASED]
    blind_m, near_m, far_m = RANGES_M
    rates = [rate for by_scenario in CHALLENGING.values() for rate in by_scenario.values()]
    step = min(abs(a - b) for a in rates for b in rates if abs(a - b) > 1e-9)
    return _PAGE.format(
        near=rule[near_m], far=rule[far_m], near_m=near_m, far_m=far_m, blind_m=blind_m,
        blind=rule[blind_m], step=round(step, 3),
        collision_stop=ACTION_USAGE[COLLISION_AWARE]["stop"],
        risk_stop=ACTION_USAGE[RISK_AWARE]["stop"],
        own_fall=_here(lines, (near_m, far_m)), own_blind=_here(lines, (blind_m,)),
    )  # fmt: skip


def _here(lines: Sequence[Line], ranges_m: Sequence[float]) -> str:
    """Return the rule's mean speeds here, empty where they were not driven."""
    found = []
    for traffic in TRAFFIC:
        evidence = Evidence(lines, traffic)
        speeds = [
            bare(evidence.of(RULE_BASED, "mean_speed_mps", range_m=each), as_speed)
            for each in ranges_m
        ]
        if NOTHING not in speeds:
            found.append(f"{' and '.join(speeds)} with {traffic} traffic")
    return f" Here: {', '.join(found)}." if found else ""
