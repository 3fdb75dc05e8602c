# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest
from intersection_msgs.msg import Decision

from risk_dqn_planner.errors import BagError
from risk_dqn_planner.ros.conversions import to_stamp
from sim_bridge.ros.expectations import (
    changes,
    lines_of,
    log_changes,
    read_decisions,
    write_decisions,
)


def decision(time_s: float, action: int, **fields: object) -> Decision:
    message = Decision(
        action=action,
        proposed=action,
        critical_vehicle_id=Decision.NO_ID,
        critical_lane_id=Decision.NO_ID,
    )
    for name, value in fields.items():
        setattr(message, name, value)
    message.header.stamp = to_stamp(round(time_s * 1e9))
    return message


def test_a_line_says_all_that_must_not_change() -> None:
    lines = lines_of(
        [
            decision(9.5, Decision.FAST, reason=Decision.CLEAR),
            decision(
                10.0,
                Decision.STOP,
                reason=Decision.VEHICLE,
                critical_vehicle_id=3,
                critical_lane_id=-7,
                supervisor=Decision.SUPERVISOR_OVERRULED,
                proposed=Decision.SLOW,
                text="numbers in here may differ in their last digits",
            ),
            decision(
                10.5, Decision.STOP, reason=Decision.STALE_INPUT, faulty_input=Decision.OBJECTS
            ),
        ]
    )
    assert lines == {
        "9.5": "FAST, CLEAR",
        "10.0": "STOP, VEHICLE, vehicle 3, lane -7, SLOW OVERRULED",
        "10.5": "STOP, STALE_INPUT, of objects",
    }


def test_what_was_written_is_read_again(tmp_path: Path) -> None:
    lines = {"9.5": "FAST, CLEAR", "10.0": "STOP, VEHICLE, vehicle 3"}
    write_decisions(tmp_path, lines)
    assert read_decisions(tmp_path) == lines
    assert (tmp_path / "decisions.txt").read_text() == (
        "9.5 s: FAST, CLEAR\n10.0 s: STOP, VEHICLE, vehicle 3\n"
    )


def test_a_new_bag_expects_nothing_and_a_damaged_one_is_refused(tmp_path: Path) -> None:
    assert read_decisions(tmp_path) == {}
    (tmp_path / "decisions.txt").write_text("9.5 FAST\n")
    with pytest.raises(BagError, match="is damaged"):
        read_decisions(tmp_path)


def test_changes_name_time_old_and_new_decision_in_the_order_of_time() -> None:
    before = {"9.5": "FAST, CLEAR", "10.0": "SLOW, VEHICLE", "10.5": "STOP, VEHICLE"}
    after = {"9.5": "FAST, CLEAR", "10.0": "STOP, VEHICLE", "11.0": "FAST, CLEAR"}
    assert changes(before, after) == [
        "t = 10.0 s: SLOW, VEHICLE -> STOP, VEHICLE",
        "t = 10.5 s: STOP, VEHICLE -> no decision in time",
        "t = 11.0 s: no decision in time -> FAST, CLEAR",
    ]
    assert changes(after, after) == []


def test_the_log_grows_and_shows_no_more_than_a_few_lines_of_each_bag(tmp_path: Path) -> None:
    log_changes(tmp_path, {"merge": ["t = 1.0 s: A -> B"]}, "first reason")
    log_changes(tmp_path, {"dense": [f"t = {k}.0 s: A -> B" for k in range(20)]}, "second one")
    text = (tmp_path / "CHANGES.md").read_text()
    assert text.count("# Intended changes of decisions") == 1
    assert text.index("first reason") < text.index("- merge: 1 decisions") < text.index("second")
    assert "- dense: 20 decisions" in text
    assert text.count("t = ") == 1 + 8
    assert "and 12 more" in text
