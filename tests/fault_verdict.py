# SPDX-License-Identifier: Apache-2.0
"""Whether the planner has reacted to a fault as it must."""

from fault_cases import Case, Told
from fault_driver import Reaction
from intersection_msgs.msg import Decision

from risk_dqn_planner.decision import Reason
from risk_dqn_planner.faults import FaultyInput


def told_by(decision: Decision) -> Told:
    return Told(Reason(decision.reason), FaultyInput(decision.faulty_input))


def complaints(case: Case, reaction: Reaction) -> list[str]:
    """Everything that is wrong with a reaction."""
    during, after = list(reaction.during), list(reaction.after)
    if case.told is None:
        strange = [d.text for d in during + after if d.reason != Decision.FIXED]
        return [f"should drive on, but said {strange}"] if strange else []
    found = []
    if reaction.react_s is None or reaction.react_s > case.reaction_s + 1e-6:
        found.append(f"reacted after {reaction.react_s} s, expected {case.reaction_s}")
    if reaction.recover_s is None or reaction.recover_s > case.recovery_s + 1e-6:
        found.append(f"recovered after {reaction.recover_s} s, expected {case.recovery_s}")
    first = next((k for k, d in enumerate(during) if d.action == Decision.STOP), len(during))
    found += [f"drives in spite of it: {d.text}" for d in during[first:] if d.action]
    expected = {case.told, *case.passing}
    said = [told_by(d) for d in during[first:]]
    found += [f"said {one} in passing" for one in said if one not in expected]
    if case.steady and case.frames > 1 and said and said[-1] != case.told:
        found.append(f"settled on {said[-1]}, expected {case.told}")
    later = [told_by(d) for d in after if d.reason not in (Decision.FIXED, Decision.RECOVERING)]
    found += [f"said {one} afterwards" for one in later if one not in expected]
    if reaction.levels is not None and reaction.levels != dict(case.levels):
        found.append(f"diagnostics {reaction.levels}, expected {dict(case.levels)}")
    return found
