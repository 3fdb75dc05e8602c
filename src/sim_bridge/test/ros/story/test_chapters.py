# SPDX-License-Identifier: Apache-2.0
"""What becomes a line of a story, and what does not."""

from risk_dqn_planner.policies.base import Action
from sim_bridge.ros.story.chapters import chapters
from sim_bridge.ros.story.reading import Mark, Moment

STOP, SLOW, FAST = Action


def at(time_s: float, action: Action, *cause: int) -> Moment:
    return Moment(round(time_s * 1e9), action, f"{action.name}: why", cause)


def test_only_changes_of_action_or_cause_are_told() -> None:
    story = [at(0.0, FAST), at(0.5, FAST), at(1.0, STOP, 1), at(1.5, STOP, 2), at(2.0, STOP, 2)]
    (chapter,) = chapters(story)
    assert [c.moment for c in chapter.changes] == [story[0], story[2], story[3]]
    assert [c.lasted_s for c in chapter.changes] == [1.0, 0.5, 0.5]
    assert [chapter.seconds(c.moment) for c in chapter.changes] == [0.0, 1.0, 1.5]


def test_everything_is_told_if_wanted() -> None:
    (chapter,) = chapters([at(0.0, FAST), at(0.5, FAST)], everything=True)
    assert len(chapter.changes) == 2


def test_silence_is_told_even_if_nothing_changed() -> None:
    (chapter,) = chapters([at(0.0, FAST), at(0.5, FAST), at(2.5, FAST), at(3.5, FAST)])
    assert [c.silence_s for c in chapter.changes] == [0.0, 2.0]
    assert [c.lasted_s for c in chapter.changes] == [0.5, 1.0]


def test_episodes_are_chapters() -> None:
    begin, end = Mark(0, True, "seed 3 starts"), Mark(0, False, "seed 3 ends")
    again = Mark(0, True, "seed 4 starts")
    first, second = chapters([begin, at(5.0, FAST), end, again, at(9.0, FAST)])
    assert (first.heading, first.ending) == ("seed 3 starts", "seed 3 ends")
    assert (second.heading, second.ending) == ("seed 4 starts", "")
    assert [c.silence_s for c in second.changes] == [0.0]
    assert second.seconds(second.moments[0]) == 0.0


def test_a_clock_that_goes_back_begins_a_chapter() -> None:
    first, second = chapters([at(5.0, FAST), at(1.0, FAST)])
    assert first.heading == ""
    assert second.heading == "the clock went back by 4.0 s"


def test_without_decisions_there_is_no_chapter() -> None:
    assert chapters([Mark(0, True, "starts"), Mark(1, False, "ends")]) == []
