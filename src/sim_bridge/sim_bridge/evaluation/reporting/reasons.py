# SPDX-License-Identifier: Apache-2.0
"""Why results are as they are: each reason is told only where the data show what it explains."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from sim_bridge.environment.rewards import REWARDS
from sim_bridge.evaluation.cells import CHALLENGES, RANGES_M, RESPAWNING, TRAFFIC
from sim_bridge.evaluation.clairvoyant import NAME as CLAIRVOYANT
from sim_bridge.evaluation.reporting.markdown import as_percent, as_speed
from sim_bridge.evaluation.reporting.paper_values import COLLISION_AWARE, RISK_AWARE, RULE_BASED
from sim_bridge.evaluation.reporting.selection import Line, cell_of, policies, reader, spread
from sim_bridge.evaluation.reporting.verdicts import HIGH, NOTHING_LEFT, Evidence

DENSE, OCCLUDED, NOISE = CHALLENGES[:3]


class Shown(NamedTuple):
    """A rate, and where it was found."""

    rate: float
    scenario: str
    traffic: str

    def __str__(self) -> str:
        return f"{as_percent(self.rate)} in {self.scenario.replace('_', ' ')}, {self.traffic}"


def _rates(lines: Sequence[Line], role: str, key: str, scenarios: Sequence[str]) -> list[Shown]:
    found = []
    for traffic in TRAFFIC:
        for scenario in scenarios:
            value = Evidence(lines, traffic).of(role, key, scenario)
            if value is not None:
                found.append(Shown(value.value, scenario, traffic))
    return found


def _freezing(lines: Sequence[Line]) -> str:
    frozen = [
        each
        for each in _rates(lines, RISK_AWARE, "timeout", (DENSE, OCCLUDED))
        if each.rate > 1.0 - HIGH
    ]
    if not frozen:
        return ""
    reward = REWARDS["risk"]
    # v / v_max in each step of 0.5 s, v_max 5 m/s: the same for each metre at any speed.
    per_metre = reward.utility_weight / (5.0 * 0.5)
    metres = reward.risk_weight / per_metre
    return (
        "**The risk-aware policy waits for ever where crossing always costs something** (timeouts: "
        f"{'; '.join(map(str, frozen))}). Utility adds up to {per_metre:g} a metre at any speed, "
        f"and a fully unsafe step costs {reward.risk_weight:g}, as much as {metres:g} m of way are "
        "worth. Standing costs nothing. Where a crossing takes more than two or three unsafe "
        "steps, never to cross is the better policy, and it learns just that. Success alone would "
        "hide whether a policy that fails stands or collides, so both are given everywhere here."
    )


def _gambling(lines: Sequence[Line]) -> str:
    collisions = [
        each
        for each in _rates(lines, COLLISION_AWARE, "collision", CHALLENGES)
        if each.rate > NOTHING_LEFT
    ]
    if not collisions:
        return ""
    reward = REWARDS["collision"]
    worth_it = reward.goal / (reward.goal - reward.collision)
    return (
        "**The collision-aware policy takes a chance where it cannot see** (collisions: "
        f"{'; '.join(map(str, collisions))}). With {reward.goal:+g} for the goal and "
        f"{reward.collision:+g} for a collision, going pays as long as it ends well in more than "
        f"{as_percent(1.0 - worth_it)} of cases, and nothing is gained by waiting for a sight that "
        "does not get better."
    )


def _worst_case(lines: Sequence[Line]) -> str:
    waits = [
        each
        for each in _rates(lines, RULE_BASED, "timeout", ("base", DENSE, OCCLUDED))
        if each.rate > 1.0 - HIGH
    ]
    if not waits:
        return ""
    return (
        "**The rule is overcautious, as the paper says** (timeouts: "
        f"{'; '.join(map(str, waits))}). It goes only where every vehicle, seen or hidden, may "
        "accelerate to the limit and still leave 3 s behind the ego, the *desired* gap. "
        "From the stop line that takes a lane that is seen for some 48 m, which obstacles often "
        "prevent, and gaps that dense traffic seldom has."
    )


def _short_sight(lines: Sequence[Line]) -> str:
    evidence = Evidence(lines, RESPAWNING)
    speed = evidence.of(RULE_BASED, "mean_speed_mps", range_m=RANGES_M[0])
    waits = evidence.of(RULE_BASED, "timeout", range_m=RANGES_M[0])
    if speed is None or waits is None or waits.value < 1.0 - NOTHING_LEFT or speed.value <= 0.0:
        return ""
    return (
        f"**At {RANGES_M[0]:g} m the rule never crosses, but it does drive**: "
        f"{as_speed(speed.value)}, since it comes up to the line before it waits for the rest of "
        "the time. How the paper's 0.0 m/s was measured is not said."
    )


def _bolder_with_sight(lines: Sequence[Line]) -> str:
    evidence = Evidence(lines, RESPAWNING)
    speeds = [evidence.of(RULE_BASED, "mean_speed_mps", range_m=each) for each in RANGES_M[1:]]
    near, far = speeds
    if near is None or far is None or far.value < near.value:
        return ""
    return (
        "**More sight does not slow the rule down**: "
        f"{as_speed(near.value)} at {RANGES_M[1]:g} m, {as_speed(far.value)} at {RANGES_M[2]:g} m. "
        "A hidden vehicle further away is a milder worst case, so Algorithm 1 alone does not "
        "explain the paper's fall; perhaps its episodes at 90 m were others."
    )


def _possible(lines: Sequence[Line]) -> str:
    shares = [
        value.value
        for scenario in ("base", *CHALLENGES)
        for traffic in TRAFFIC
        for value in [spread(cell_of(lines, CLAIRVOYANT, scenario, traffic), reader("success"))]
        if value is not None
    ]
    if not shares:
        return ""
    least = min(shares)
    found = (
        "in every episode of every situation. Nothing here is impossible: a timeout is the price "
        "of not knowing, or of caution"
        if least == 1.0
        else f"in {as_percent(least)} or more of the episodes of each situation"
    )
    return f"**What could be done**: the clairvoyant, who knows all traffic, gets through {found}."


def _seeds(lines: Sequence[Line]) -> str:
    trained = {
        policy: len({line["training_seed"] for line in lines if line["policy"] == policy})
        for policy in policies(lines)
        if any(line["policy"] == policy and line["training_seed"] is not None for line in lines)
    }
    if not trained:
        return ""
    listed = ", ".join(f"{policy} {count}" for policy, count in trained.items())
    alone = [policy for policy, count in trained.items() if count == 1]
    warning = (
        f" A single seed says little about a method: {', '.join(alone)} should be taken as one "
        "example."
        if alone
        else ""
    )
    return f"**Seeds**: {listed}. The paper does not say how many it trained.{warning}"


_REASONS: tuple[Callable[[Sequence[Line]], str], ...] = (
    _freezing,
    _gambling,
    _worst_case,
    _short_sight,
    _bolder_with_sight,
    _possible,
    _seeds,
)


def reasons(lines: Sequence[Line]) -> str:
    """Return what the results show and why, as a list in Markdown."""
    told = [text for text in (reason(lines) for reason in _REASONS) if text]
    return "".join(f"- {text}\n" for text in told)
