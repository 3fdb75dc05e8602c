# SPDX-License-Identifier: Apache-2.0
import pytest
from rclpy.serialization import serialize_message

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.ros.conversions import header
from sim_bridge.ros import topics
from sim_bridge.ros.recording import Stored
from sim_bridge.ros.replay import parse_override
from sim_bridge.ros.replayer import frames


def stored(topic: topics.Topic, stamp_ns: int) -> Stored:
    message = topic.message(header=header(stamp_ns))
    return Stored(stamp_ns, topic.name, serialize_message(message))


def test_messages_of_one_time_make_a_frame_whose_objects_come_last() -> None:
    order = (topics.DECISION, topics.OBJECTS, topics.ODOMETRY, topics.ROUTE)
    found = list(frames([stored(topic, 500) for topic in order]))
    assert len(found) == 1
    assert found[0].stamp_ns == 500
    assert [m.topic for m in found[0].inputs] == ["/route", "/odometry", "/objects"]
    assert found[0].complete


def test_frames_come_in_the_order_of_time_and_some_lack_their_objects() -> None:
    found = list(frames([stored(topics.ODOMETRY, 700), stored(topics.OBJECTS, 200)]))
    assert [(frame.stamp_ns, frame.complete) for frame in found] == [(200, True), (700, False)]


def test_decisions_alone_make_no_frame() -> None:
    assert list(frames([stored(topics.DECISION, 500)])) == []


@pytest.mark.parametrize(
    ("text", "value"),
    [("a:=2.5", 2.5), ("a:=7", 7), ("a:=true", True), ("a:=name", "name"), ("a:=[1, 2]", [1, 2])],
)
def test_overrides_are_read_as_ros_reads_them(text: str, value: object) -> None:
    assert parse_override(text) == ("a", value)


def test_an_override_without_a_value_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="expected NAME:=VALUE"):
        parse_override("a=2.5")
