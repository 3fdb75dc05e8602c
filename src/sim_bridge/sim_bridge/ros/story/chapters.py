# SPDX-License-Identifier: Apache-2.0
"""What a reader wants of a row of decisions: when they changed, and where an episode ends."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.ros.story.reading import Mark, Moment

# Decisions come at 2 Hz; nobody may wait longer than this for one.
LONGEST_SILENCE_S = 1.0


@dataclass
class Change:
    """A decision that differs from the one before, and for how long it was repeated.

    until_ns: the next change, or the last repetition before silence or the end.
    silence_s: before it, where nobody decided for too long, else 0.
    """

    moment: Moment
    until_ns: int
    silence_s: float = 0.0

    @property
    def lasted_s(self) -> float:
        """How long the decision was in force."""
        return (self.until_ns - self.moment.stamp_ns) / SECOND_NS


@dataclass
class Chapter:
    """An episode, or all there is between two jumps of the clock."""

    heading: str = ""
    ending: str = ""
    changes: list[Change] = field(default_factory=list)
    moments: list[Moment] = field(default_factory=list)

    @property
    def begin_ns(self) -> int:
        """Time of its first decision."""
        return self.moments[0].stamp_ns

    def seconds(self, moment: Moment) -> float:
        """Time of a decision since the first one."""
        return (moment.stamp_ns - self.begin_ns) / SECOND_NS


def chapters(events: Sequence[Moment | Mark], *, everything: bool = False) -> list[Chapter]:
    """Group decisions by episode, and within by what stays the same; those without are left out.

    everything: take every decision for a change.
    """
    found = [Chapter()]
    for event in events:
        if isinstance(event, Mark):
            if not event.is_start:
                found[-1].ending = event.text
            elif found[-1].moments:
                found.append(Chapter(heading=event.text))
            else:
                found[-1].heading = event.text
            continue
        last = found[-1].moments[-1] if found[-1].moments else None
        if last is not None and event.stamp_ns < last.stamp_ns:
            back_s = (last.stamp_ns - event.stamp_ns) / SECOND_NS
            found.append(Chapter(heading=f"the clock went back by {back_s:.1f} s"))
        _add(found[-1], event, everything)
    return [chapter for chapter in found if chapter.moments]


def _add(chapter: Chapter, moment: Moment, everything: bool) -> None:
    silence_s = 0.0
    if chapter.moments:
        silence_s = (moment.stamp_ns - chapter.moments[-1].stamp_ns) / SECOND_NS
    silent = silence_s > LONGEST_SILENCE_S
    chapter.moments.append(moment)
    if chapter.changes and not silent:
        last = chapter.changes[-1]
        last.until_ns = moment.stamp_ns
        same = (last.moment.action, last.moment.cause) == (moment.action, moment.cause)
        if same and not everything:
            return
    chapter.changes.append(Change(moment, moment.stamp_ns, silence_s if silent else 0.0))
