# SPDX-License-Identifier: Apache-2.0
"""The story of bags that were written here, by this and by an older version of the messages."""

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from intersection_msgs.msg import Decision, EpisodeEvent, Explanation
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from risk_dqn_planner.ros.conversions import to_stamp
from sim_bridge.ros import topics
from sim_bridge.ros.recording import BagWriter, Stored
from sim_bridge.ros.story.command import main

SECOND = 1_000_000_000


def stored(topic: topics.Topic, stamp_ns: int, message: Any) -> Stored:  # noqa: ANN401
    message.header.stamp = to_stamp(stamp_ns)
    return Stored(stamp_ns, topic.name, serialize_message(message))


def decision(stamp_ns: int, action: int, text: str, line_m: float = 12.34) -> Stored:
    why = Explanation(stop_line_distance_m=line_m, ego_speed_mps=4.96)
    message = Decision(action=action, text=text, explanation=why)
    return stored(topics.DECISION, stamp_ns, message)


def episode(stamp_ns: int, event: int) -> Stored:
    message = EpisodeEvent(seed=3, scenario="base", event=event, duration_s=1.0)
    return stored(topics.EPISODE, stamp_ns, message)


DRIVE = (
    episode(SECOND, EpisodeEvent.STARTED),
    decision(SECOND, Decision.FAST, "FAST: no conflict within range"),
    decision(3 * SECOND // 2, Decision.FAST, "FAST: no conflict within range"),
    decision(2 * SECOND, Decision.STOP, "STOP: vehicle [17] reaches", 7.0),
    episode(2 * SECOND, EpisodeEvent.COLLISION),
)


def write(path: Path, messages: Sequence[Stored]) -> Path:
    kinds = (topics.ODOMETRY, topics.DECISION, topics.EPISODE)
    with BagWriter(path, kinds, {}) as bag:
        bag.write(messages)
    return path


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return write(tmp_path / "drive", DRIVE)


def cells(line: str) -> list[str]:
    return [cell for cell in line.rstrip().split("  ") if cell]


def test_changes_are_told_with_time_place_speed_and_reason(
    bag: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(bag)]) == 0
    heading, _, first, second, ending, total = capsys.readouterr().out.splitlines()
    assert heading == "episode base, seed 3, starts"
    words = " ".join(first.split())
    assert words == "0.0 1.00 s 1.0 12.3 5.0 FAST no conflict within range"
    assert " ".join(second.split()) == "1.0 2.00 s 0.0 7.0 5.0 STOP vehicle [17] reaches"
    assert ending == "episode base, seed 3, ends: collision after 1.0 s"
    assert total == f"{bag} /decision: 3 decisions, 2 told"


def test_every_decision_is_told_if_wanted(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(bag), "--all"]) == 0
    assert "3 decisions, 3 told" in capsys.readouterr().out


def test_a_file_of_the_bag_will_do(bag: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(bag / "drive.mcap")]) == 0
    assert "3 decisions" in capsys.readouterr().out


def test_dates_are_told_in_utc(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stamp_ns = 1_700_000_000 * SECOND + 250_000_000
    path = write(tmp_path / "drive", [decision(stamp_ns, Decision.SLOW, "SLOW: because")])
    assert main([str(path)]) == 0
    assert "2023-11-14 22:13:20.25Z" in capsys.readouterr().out


def test_the_speed_of_odometry_stands_in_where_a_decision_has_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    moving = Odometry()
    moving.twist.twist.linear.x = 3.21
    fault = Decision(text="STOP: no objects")
    fault.explanation.ego_speed_mps = fault.explanation.stop_line_distance_m = float("nan")
    late = Decision(text="STOP: still no objects", reason=Decision.FIXED)
    late.explanation.ego_speed_mps = late.explanation.stop_line_distance_m = float("nan")
    messages = [
        stored(topics.ODOMETRY, SECOND, moving),
        stored(topics.DECISION, SECOND, fault),
        stored(topics.DECISION, 2 * SECOND, late),
    ]
    assert main([str(write(tmp_path / "drive", messages))]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "0.0 1.00 s 1.0 - 3.2 STOP no objects" in lines
    assert "1.0 2.00 s 0.0 - - STOP still no objects" in lines


OLD = """std_msgs/Header header
uint8 action
uint8 reason
string text
int64 critical_vehicle_id
int64 critical_lane_id
"""


def test_older_decisions_on_other_topics_are_told_by_the_definitions_in_the_bag(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name, store = "intersection_msgs/msg/Decision", get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(OLD, name))
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=5, nanosec=0)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="map")
    with Writer(tmp_path / "old", version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        for topic in ("/front/decision", "/rear/decision"):
            connection = bag.add_connection(topic, name, typestore=store)
            message = types[name](header, 1, 1, f"SLOW: by {topic}", 17, 3)
            bag.write(connection, 7, store.serialize_cdr(message, name))
    assert main([str(tmp_path / "old"), "--topic", "/rear/decision"]) == 0
    assert "SLOW    by /rear/decision" in capsys.readouterr().out
    assert main([str(tmp_path / "old")]) == 2
    assert "/front/decision, /rear/decision: choose one by --topic" in capsys.readouterr().err
    assert main([str(tmp_path / "old"), "--topic", "/x"]) == 2
    assert "expected one of: /front/decision, /rear/decision" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (shutil.rmtree, "is no bag, expected a folder with metadata.yaml"),
        (lambda bag: (bag / "drive.mcap").write_bytes(b"spoilt"), "cannot be read as a bag"),
        (lambda bag: (bag / "drive.mcap").unlink(), "cannot be read as a bag"),
    ],
    ids=["no folder", "damaged", "no file"],
)
def test_a_bag_that_is_no_good_is_named_in_one_sentence(
    bag: Path, spoil: Callable[[Path], object], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    spoil(bag)
    assert main([str(bag)]) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert len(error.strip().splitlines()) == 1


def test_a_bag_without_decisions_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "empty", [episode(0, EpisodeEvent.STARTED)])
    assert main([str(path)]) == 2
    assert "holds no message of type intersection_msgs/msg/Decision" in capsys.readouterr().err


def test_a_picture_is_drawn(bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(bag), "--picture", str(tmp_path / "story.svg")]) == 0
    assert (tmp_path / "story.svg").read_text("utf-8").startswith("<?xml")
    assert main([str(bag), "--picture", str(tmp_path / "story.xyz")]) == 2
    assert "story.xyz cannot be written as a picture" in capsys.readouterr().err
