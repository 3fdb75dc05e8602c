# SPDX-License-Identifier: Apache-2.0
from collections.abc import Sequence
from pathlib import Path

import pytest
from intersection_msgs.msg import Decision, PerceivedObject, PerceivedObjects
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import serialize_message

from risk_dqn_planner.errors import BagError
from risk_dqn_planner.ros.conversions import to_stamp
from sim_bridge.ros import topics
from sim_bridge.ros.recording import BagWriter, Stored, no_bag, read_bag, stamp_of

TOPICS = (topics.OBJECTS, topics.DECISION)


def objects(stamp_ns: int, x_m: float) -> Stored:
    message = PerceivedObjects(objects=[PerceivedObject(id=2**62 + 1, x_m=x_m)])
    message.header.stamp = to_stamp(stamp_ns)
    return Stored(stamp_ns, topics.OBJECTS.name, serialize_message(message))


def decision(stamp_ns: int) -> Stored:
    message = Decision(action=Decision.FAST, text="the road is free")
    message.header.stamp = to_stamp(stamp_ns)
    return Stored(stamp_ns, topics.DECISION.name, serialize_message(message))


def record(path: Path, messages: Sequence[Stored]) -> Path:
    with BagWriter(path, TOPICS, {"map": "four_way"}) as bag:
        bag.write(messages)
    return path


def test_the_stamp_is_read_from_the_serialised_header() -> None:
    assert stamp_of(objects(12_345_678_901, 0.0).data) == 12_345_678_901


def test_a_bag_gives_back_what_was_written_ordered_by_stamp_and_topic(tmp_path: Path) -> None:
    late, early = objects(2_000_000_000, 7.5), objects(1_000_000_000, -3.0)
    beside = decision(1_000_000_000)
    bag = read_bag(record(tmp_path / "bag", [beside, late, early]), TOPICS)
    assert list(bag.messages) == [early, beside, late]
    assert bag.notes == {"map": "four_way"}
    assert bag.of(topics.DECISION) == [beside]


def test_the_same_messages_give_the_same_file_whatever_their_order(tmp_path: Path) -> None:
    messages = [objects(3, 1.0), decision(3), objects(1, 2.0)]
    one = record(tmp_path / "a" / "bag", messages)
    two = record(tmp_path / "b" / "bag", messages[::-1])
    assert (one / "bag.mcap").read_bytes() == (two / "bag.mcap").read_bytes()


def test_an_independent_reader_finds_the_same_values(tmp_path: Path) -> None:
    path = record(tmp_path / "bag", [objects(1_500_000_000, 7.5)])
    with (path / "bag.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        found = [(m.log_time, ros) for _, _, m, ros in reader.iter_decoded_messages(["/objects"])]
    assert len(found) == 1
    stamp_ns, message = found[0]
    assert stamp_ns == 1_500_000_000
    assert message.objects[0].x_m == 7.5
    assert message.objects[0].id == 2**62 + 1


def test_the_metadata_is_what_jazzy_expects(tmp_path: Path) -> None:
    text = (record(tmp_path / "bag", [decision(1)]) / "metadata.yaml").read_text("utf-8")
    assert "version: 9" in text
    assert "storage_identifier: mcap" in text
    assert "reliability: reliable" in text


def test_a_path_without_a_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="nowhere is no bag, expected a folder"):
        read_bag(tmp_path / "nowhere", TOPICS)
    with pytest.raises(BagError, match="is no bag"):
        read_bag(tmp_path, TOPICS)


def test_who_misspells_a_bag_is_told_the_names_there_are(tmp_path: Path) -> None:
    for name in ("t_junction", "four_way"):
        record(tmp_path / name, [decision(1)])
    (tmp_path / "CHANGES.md").touch()
    assert str(no_bag(Path("fourway"), tmp_path)) == (
        "fourway is no bag, expected a folder with metadata.yaml, or one of four_way, t_junction"
    )


def test_a_damaged_bag_is_refused(tmp_path: Path) -> None:
    path = record(tmp_path / "bag", [decision(1)])
    (path / "bag.mcap").write_bytes(b"not an MCAP file at all")
    with pytest.raises(BagError, match="cannot be read as a bag"):
        read_bag(path, TOPICS)


def test_a_bag_without_a_needed_topic_is_refused(tmp_path: Path) -> None:
    path = record(tmp_path / "bag", [decision(1)])
    with pytest.raises(BagError, match="lacks the topic /route"):
        read_bag(path, [topics.ROUTE])


def test_an_existing_bag_is_not_overwritten(tmp_path: Path) -> None:
    record(tmp_path / "bag", [decision(1)])
    with pytest.raises(BagError, match="exists already"):
        record(tmp_path / "bag", [decision(1)])
