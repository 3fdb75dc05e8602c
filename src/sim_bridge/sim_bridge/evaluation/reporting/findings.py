# SPDX-License-Identifier: Apache-2.0
"""What the paper says of its figures, held against our results: each verdict is computed."""

from collections.abc import Callable, Sequence

from sim_bridge.evaluation.cells import CHALLENGES, RANGES_M
from sim_bridge.evaluation.reporting.curves import Curve, Curves
from sim_bridge.evaluation.reporting.markdown import as_percent, as_speed
from sim_bridge.evaluation.reporting.paper_values import (
    COLLISION_AWARE,
    RISK_AWARE,
    RULE_BASED,
    paper_role,
)
from sim_bridge.evaluation.reporting.selection import Line, Spread
from sim_bridge.evaluation.reporting.verdicts import (
    ALIKE,
    HIGH,
    NOTHING_LEFT,
    Evidence,
    Finding,
    Verdict,
    all_above,
    collected,
    more,
    times,
)


def about_actions(lines: Sequence[Line]) -> list[Finding]:
    """The figure of action usage."""

    def alike(evidence: Evidence) -> Verdict | None:
        fast = [evidence.actions(role).get("fast") for role in (COLLISION_AWARE, RISK_AWARE)]
        known = [value for value in fast if value is not None]
        if len(known) < len(fast):
            return None
        numbers = " and ".join(times(value.value) for value in known)
        far = any(value.low > 1 + ALIKE or value.high < 1 - ALIKE for value in known)
        near = all(value.low >= 1 - ALIKE and value.high <= 1 + ALIKE for value in known)
        return Verdict(False if far else True if near else None, numbers)

    def compare(role: str, other: str, action: str) -> Callable[[Evidence], Verdict | None]:
        return lambda evidence: more(
            evidence.actions(role).get(action), evidence.actions(other).get(action), times
        )

    return collected(
        lines,
        {
            "all three drive fast about equally often (collision-aware, risk-aware)": alike,
            "the collision-aware policy drives slow less than the rule": compare(
                RULE_BASED, COLLISION_AWARE, "slow"
            ),
            "the risk-aware policy drives slow more than the collision-aware one": compare(
                RISK_AWARE, COLLISION_AWARE, "slow"
            ),
            "the risk-aware policy drives slow more than the rule": compare(
                RISK_AWARE, RULE_BASED, "slow"
            ),
            "the rule stops more than the risk-aware policy": compare(
                RULE_BASED, RISK_AWARE, "stop"
            ),
            "the collision-aware policy stops more than the risk-aware one": compare(
                COLLISION_AWARE, RISK_AWARE, "stop"
            ),
        },
    )


def about_challenges(lines: Sequence[Line]) -> list[Finding]:
    """The figure of the four challenging groups."""

    def compare(key: str, role: str, other: str, scenario: str) -> Callable[..., Verdict | None]:
        return lambda evidence: more(
            evidence.of(role, key, scenario), evidence.of(other, key, scenario), as_percent
        )

    succeeds = {
        f"the risk-aware policy succeeds more than the collision-aware one: {name}": compare(
            "success", RISK_AWARE, COLLISION_AWARE, scenario
        )
        for scenario in CHALLENGES
        for name in [scenario.replace("_", " ")]
    }
    collides = {
        f"the collision-aware policy collides more than the risk-aware one: {name}": compare(
            "collision", COLLISION_AWARE, RISK_AWARE, scenario
        )
        for scenario in CHALLENGES
        for name in [scenario.replace("_", " ")]
    }
    return collected(lines, {**succeeds, **collides})


def about_ranges(lines: Sequence[Line]) -> list[Finding]:
    """The figure of mean speed by sensor range."""

    def fails(evidence: Evidence) -> Verdict | None:
        return all_above(
            [evidence.of(RULE_BASED, "timeout", range_m=RANGES_M[0])], 1.0 - NOTHING_LEFT
        )

    def drives(evidence: Evidence) -> Verdict | None:
        return all_above(
            [evidence.of(RISK_AWARE, "success", range_m=range_m) for range_m in RANGES_M], HIGH
        )

    def steady(evidence: Evidence) -> Verdict | None:
        speeds = [evidence.of(RISK_AWARE, "mean_speed_mps", range_m=each) for each in RANGES_M]
        known = [value.value for value in speeds if value is not None]
        if len(known) < len(speeds):
            return None
        return Verdict(
            (max(known) - min(known)) / max(known) <= ALIKE,
            f"{as_speed(min(known))} to {as_speed(max(known))}",
        )

    def faster(range_m: float) -> Callable[[Evidence], Verdict | None]:
        return lambda evidence: more(
            evidence.of(RISK_AWARE, "mean_speed_mps", range_m=range_m),
            evidence.of(RULE_BASED, "mean_speed_mps", range_m=range_m),
            as_speed,
        )

    def falls(evidence: Evidence) -> Verdict | None:
        near, far = (
            evidence.of(RULE_BASED, "mean_speed_mps", range_m=each) for each in RANGES_M[1:]
        )
        return more(near, far, as_speed)

    shorter, longer = (f"{range_m:g} m" for range_m in RANGES_M[1:])
    return collected(
        lines,
        {
            f"the rule fails at {RANGES_M[0]:g} m (share of timeouts)": fails,
            "the risk-aware policy gets through at every range (success)": drives,
            "the risk-aware policy's speed hardly depends on the range": steady,
            **{
                f"the risk-aware policy is faster than the rule at {range_m:g} m": faster(range_m)
                for range_m in RANGES_M
            },
            f"the rule is slower at {longer} than at {shorter}": falls,
        },
    )


def about_training(curves: Curves) -> list[tuple[str, Verdict]]:
    """The figure of success during training, which the paper draws without numbers."""
    of_role = {paper_role(name): each for name, each in curves.items()}
    if RISK_AWARE not in of_role or COLLISION_AWARE not in of_role:
        return []
    risk, collision = of_role[RISK_AWARE], of_role[COLLISION_AWARE]
    last = [_over_seeds(each, lambda curve: curve.last().mean()) for each in (risk, collision)]
    wavering = [_over_seeds(each, Curve.unsteadiness) for each in (collision, risk)]
    smoother = more(wavering[0], wavering[1], lambda value: f"{100 * value:.1f} points")
    if smoother is not None and min(value.seeds for value in wavering) == 1:
        smoother = smoother._replace(holds=None)  # one seed has no interval
    converged = all_above(last, HIGH)
    statements = {
        "both rewards converge to high success (risk-aware, collision-aware; last quarter)": (
            converged
        ),
        "the collision-aware policy is less stable (change from one evaluation to the next)": (
            smoother
        ),
    }
    return [(text, verdict) for text, verdict in statements.items() if verdict is not None]


def _over_seeds(curves: Sequence[Curve], measure: Callable[[Curve], float]) -> Spread:
    values = [float(measure(curve)) for curve in curves]
    return Spread(sum(values) / len(values), min(values), max(values), len(values))
