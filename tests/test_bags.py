# SPDX-License-Identifier: Apache-2.0
"""The recorded bags: the real nodes still decide as recorded, and other readers can read them."""

import shutil
import subprocess
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix
from intersection_msgs.msg import Decision, PerceivedObjects
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import deserialize_message
from rosbags.rosbag2 import Reader

from sim_bridge.ros import topics
from sim_bridge.ros.record import bags
from sim_bridge.ros.recording import installed_types, read_bag

BAGS = Path(__file__).resolve().parents[1] / "bags"
RECORDED = (*topics.INPUTS, topics.DECISION)
PATIENCE_S = 300.0


def run_replay(*options: str) -> "subprocess.CompletedProcess[str]":
    executable = Path(get_package_prefix("sim_bridge")) / "lib" / "sim_bridge" / "replay"
    return subprocess.run(
        [str(executable), *options],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


@pytest.mark.ros
@pytest.mark.parametrize("name", bags())
def test_the_nodes_decide_as_recorded(name: str) -> None:
    done = run_replay(str(BAGS / name))
    assert done.returncode == 0, done.stdout + done.stderr
    recorded = len(read_bag(BAGS / name, RECORDED).of(topics.DECISION))
    assert recorded >= 10
    assert f"{recorded} of {recorded} decisions as recorded" in done.stdout


@pytest.mark.ros
def test_a_deliberately_changed_parameter_makes_the_replay_fail() -> None:
    done = run_replay(str(BAGS / "four_way"), "--set", "sensor_range_m:=20.0")
    assert done.returncode == 1, done.stdout + done.stderr
    differences = [line for line in done.stdout.splitlines() if line.startswith("t = ")]
    assert differences
    assert "HIDDEN_VEHICLE" in done.stdout
    assert all("recorded " in line and "; now " in line for line in differences)


@pytest.mark.ros
def test_a_parameter_that_no_node_has_is_refused() -> None:
    done = run_replay(str(BAGS / "four_way"), "--set", "sensor_rnage_m:=20.0")
    assert done.returncode == 2
    assert "sensor_rnage_m" in done.stderr


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (shutil.rmtree, "is no bag"),
        (lambda bag: (bag / "metadata.yaml").unlink(), "is no bag"),
        (lambda bag: (bag / "four_way.mcap").write_bytes(b"spoilt"), "cannot be read as a bag"),
        (lambda bag: (bag / "four_way.mcap").unlink(), "cannot be read as a bag"),
    ],
    ids=["no folder", "no metadata", "damaged", "no file"],
)
def test_a_bag_that_is_no_good_is_named_in_one_sentence(
    tmp_path: Path, spoil: object, complaint: str
) -> None:
    bag = tmp_path / "four_way"
    shutil.copytree(BAGS / "four_way", bag)
    assert callable(spoil)
    spoil(bag)
    done = run_replay(str(bag))
    assert done.returncode == 2
    assert complaint in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("name", bags())
def test_an_independent_reader_finds_the_same_messages(name: str) -> None:
    ours = read_bag(BAGS / name, RECORDED)
    with (BAGS / name / f"{name}.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        theirs = [
            (channel.topic, schema.name if schema else None, decoded)
            for schema, channel, message, decoded in reader.iter_decoded_messages()
        ]
    types = {topic.name: topic.type_name for topic in RECORDED}
    assert len(theirs) == len(ours.messages)
    assert {topic: kind for topic, kind, _ in theirs} == types
    decisions = [decoded for topic, _, decoded in theirs if topic == topics.DECISION.name]
    expected = [deserialize_message(m.data, Decision) for m in ours.of(topics.DECISION)]
    assert [d.text for d in decisions] == [d.text for d in expected]
    objects = [decoded for topic, _, decoded in theirs if topic == topics.OBJECTS.name]
    ids = [[o.id for o in list_of.objects] for list_of in objects]
    lists = [deserialize_message(m.data, PerceivedObjects) for m in ours.of(topics.OBJECTS)]
    assert ids == [[o.id for o in list_of.objects] for list_of in lists]


@pytest.mark.parametrize("name", bags())
def test_a_bag_is_small_and_of_the_types_that_are_installed(name: str) -> None:
    assert sum(file.stat().st_size for file in (BAGS / name).iterdir()) < 200_000
    types = installed_types()
    with Reader(BAGS / name) as reader:
        assert {c.topic for c in reader.connections} == {topic.name for topic in RECORDED}
        for connection in reader.connections:
            assert connection.digest == types.hash_rihs01(connection.msgtype)
