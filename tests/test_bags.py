# SPDX-License-Identifier: Apache-2.0
"""The recorded bags: the real nodes still decide as recorded, and other readers can read them."""

import os
import shutil
from collections import Counter
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from commands import Done, run
from intersection_msgs.msg import Decision, PerceivedObjects
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from risk_dqn_planner.ros.conversions import ego_from_message
from risk_dqn_planner.ros.streams import SECOND_NS
from sim_bridge.maps import map_names
from sim_bridge.ros import topics
from sim_bridge.ros.bag_plan import bags
from sim_bridge.ros.expectations import lines_of, read_decisions
from sim_bridge.ros.recording import BagWriter, Stored, installed_types, read_bag

BAGS = Path(__file__).resolve().parents[1] / "bags"
RECORDED = (*topics.INPUTS, topics.DECISION)


def run_replay(*options: str) -> Done:
    return run("replay", *options)


def decisions_of(name: str) -> list[Decision]:
    messages = read_bag(BAGS / name, RECORDED).of(topics.DECISION)
    return [deserialize_message(message.data, Decision) for message in messages]


@pytest.fixture(scope="module")
def replays(request: pytest.FixtureRequest) -> dict[str, "Future[Done]"]:
    """Replays of the bags that are asked for, as many at a time as this process has processors."""
    asked = [
        item.callspec.params["replayed"]  # type: ignore[attr-defined]
        for item in request.session.items
        if "replays" in getattr(item, "fixturenames", ())
    ]
    beside = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    pool = ThreadPoolExecutor(max((os.cpu_count() or 1) // beside, 1))
    return {name: pool.submit(run_replay, str(BAGS / name)) for name in asked}


@pytest.mark.ros
@pytest.mark.parametrize("replayed", bags())
def test_the_nodes_decide_as_recorded(replayed: str, replays: dict[str, "Future[Done]"]) -> None:
    done = replays[replayed].result()
    assert done.returncode == 0, done.stdout + done.stderr
    recorded = len(decisions_of(replayed))
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
def test_the_definitions_in_a_bag_are_enough_to_read_it(name: str) -> None:
    with AnyReader([BAGS / name]) as reader:
        counts = Counter(
            type(reader.deserialize(data, connection.msgtype)).__name__
            for connection, _, data in reader.messages()
        )
    assert sum(counts.values()) == len(read_bag(BAGS / name, RECORDED).messages)
    assert counts["intersection_msgs__msg__Decision"] == len(decisions_of(name))


@pytest.mark.parametrize("name", bags())
def test_a_bag_is_small_and_of_the_types_that_are_installed(name: str) -> None:
    assert size_of(BAGS / name) < 300_000
    types = installed_types()
    with Reader(BAGS / name) as reader:
        assert {c.topic for c in reader.connections} == {topic.name for topic in RECORDED}
        for connection in reader.connections:
            assert connection.digest == types.hash_rihs01(connection.msgtype)


def size_of(folder: Path) -> int:
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def test_the_folder_holds_the_bags_that_are_planned_and_is_small() -> None:
    assert {path.parent.name for path in BAGS.glob("*/metadata.yaml")} == set(bags())
    assert len(bags()) >= 12
    assert {planned.settings.map_name for planned in bags().values()} == set(map_names())
    assert size_of(BAGS) < 3_000_000


@pytest.mark.parametrize("name", bags())
def test_a_bag_says_what_was_recorded_and_what_it_shows(name: str) -> None:
    bag = read_bag(BAGS / name, RECORDED)
    assert dict(bag.notes) == bags()[name].notes()
    assert {"map", "scenario", "seed", "policy", "supervisor", "shows"} <= set(bag.notes)


@pytest.mark.parametrize("name", bags())
def test_the_expected_decisions_can_be_read_as_text_too(name: str) -> None:
    assert read_decisions(BAGS / name) == lines_of(decisions_of(name))


# What the bags are named after happens in them.


def objects_of(name: str) -> list[PerceivedObjects]:
    messages = read_bag(BAGS / name, RECORDED).of(topics.OBJECTS)
    return [deserialize_message(message.data, PerceivedObjects) for message in messages]


def egos_of(name: str) -> np.ndarray:
    """Time [s], x, y [m], heading, speed [m/s] of the ego (N, 5)."""
    messages = read_bag(BAGS / name, RECORDED).of(topics.ODOMETRY)
    return np.array(
        [
            (m.stamp_ns / SECOND_NS, *ego_from_message(deserialize_message(m.data, Odometry)))
            for m in messages
        ]
    )


def distances(name: str) -> list[np.ndarray]:
    """Distances of the ego's centre to those of the objects [m], for each list of them."""
    egos = egos_of(name)
    return [
        np.array([np.hypot(o.x_m - x, o.y_m - y) for o in seen.objects])
        for seen, (_, x, y, _, _) in zip(objects_of(name), egos, strict=True)
    ]


@pytest.mark.parametrize(
    ("name", "topic", "faulty"),
    [
        ("odometry_lost", topics.ODOMETRY, Decision.ODOMETRY),
        ("objects_lost", topics.OBJECTS, Decision.OBJECTS),
    ],
)
def test_the_planner_stops_for_a_lost_input_and_recovers(
    name: str, topic: topics.Topic, faulty: int
) -> None:
    loss = bags()[name].settings.loss
    bag = read_bag(BAGS / name, RECORDED)
    start_ns = bag.messages[0].stamp_ns
    begin_ns = start_ns + round(loss.after_s * SECOND_NS)
    end_ns = begin_ns + round(loss.for_s * SECOND_NS)
    assert not [m for m in bag.of(topic) if begin_ns <= m.stamp_ns < end_ns]
    by_time = {m.stamp_ns: deserialize_message(m.data, Decision) for m in bag.of(topics.DECISION)}
    # An input may be 0.5 s old, and the last one came up to 0.3 s before the loss.
    lost = [d for t, d in by_time.items() if begin_ns + SECOND_NS <= t < end_ns]
    assert len(lost) >= 2
    for decision in lost:
        assert (decision.action, decision.reason) == (Decision.STOP, Decision.STALE_INPUT)
        assert decision.faulty_input == faulty
    others = [d for t, d in by_time.items() if t < begin_ns or t >= end_ns + 3 * SECOND_NS]
    assert {decision.faulty_input for decision in others} == {Decision.NO_INPUT}
    assert others[-1].action == Decision.FAST


def test_dense_traffic_is_dense() -> None:
    assert max(len(seen.objects) for seen in objects_of("dense_traffic")) >= 5


def test_nothing_is_seen_beyond_the_short_range() -> None:
    # The ego's centre to the nearest point of a vehicle 4 m long; the far end may be hidden.
    assert max(float(d.max(initial=0.0)) for d in distances("short_range")) < 40.0 + 2.5


def test_measured_speeds_jump_where_the_sensor_errs() -> None:
    def jumps(name: str) -> float:
        """Root mean square of the changes of measured speeds [m/s] within 0.3 s or less."""
        speeds = [{o.id: o.speed_mps for o in seen.objects} for seen in objects_of(name)]
        changes = [
            late[k] - early[k]
            for early, late in pairwise(speeds)
            for k in early.keys() & late.keys()
        ]
        return float(np.sqrt(np.mean(np.square(changes))))

    assert jumps("multi_lane") < 0.6
    assert jumps("sensor_noise") > 1.0


def test_a_vehicle_comes_out_right_before_the_ego_which_stops() -> None:
    egos, lists = egos_of("emergency"), objects_of("emergency")
    seen: set[int] = {o.id for o in lists[0].objects}
    stops = {
        d.header.stamp.sec + 1e-9 * d.header.stamp.nanosec: d.action == Decision.STOP
        for d in decisions_of("emergency")
    }
    found = []
    for (time_s, x, y, _, speed), message in zip(egos[1:], lists[1:], strict=True):
        new = [o for o in message.objects if o.id not in seen]
        seen |= {o.id for o in new}
        near = [o for o in new if np.hypot(o.x_m - x, o.y_m - y) < 16.0 and o.speed_mps > 3.0]
        if near and speed > 2.0:
            found.append(any(stops.get(t, False) for t in stops if 0.0 <= t - time_s <= 1.0))
    assert any(found)


def test_the_near_miss_is_near() -> None:
    # Both vehicles are 4 m long and 2 m wide: 4.5 m between centres leaves 0.5 to 2.5 m.
    moving = egos_of("near_miss")[:, 4] > 1.0
    nearest = [d.min(initial=np.inf) for d in distances("near_miss")]
    assert min(np.array(nearest)[moving]) < 7.0


def test_bags_cover_all_actions_and_the_reasons_there_are() -> None:
    decisions = [decision for name in bags() for decision in decisions_of(name)]
    assert {decision.action for decision in decisions} == {0, 1, 2}
    reasons = {decision.reason for decision in decisions}
    assert {
        Decision.CLEAR,
        Decision.VEHICLE,
        Decision.HIDDEN_VEHICLE,
        Decision.LEARNED,
        Decision.GOAL_REACHED,
        Decision.STALE_INPUT,
    } <= reasons
    assert Decision.SUPERVISOR_OVERRULED in {decision.supervisor for decision in decisions}


def spoil_decisions(source: Path, target: Path, count: int) -> None:
    """Copy a bag with other actions in its first decisions."""
    bag = read_bag(source, RECORDED)
    messages: list[Stored] = []
    left = count
    for message in bag.messages:
        kept = message
        if message.topic == topics.DECISION.name and left:
            left -= 1
            decision = deserialize_message(message.data, Decision)
            decision.action = (decision.action + 1) % 3
            kept = Stored(message.stamp_ns, message.topic, serialize_message(decision))
        messages.append(kept)
    with BagWriter(target, RECORDED, bag.notes) as writer:
        writer.write(messages)


@pytest.mark.ros
def test_changed_decisions_are_only_accepted_for_a_reason_that_is_kept(tmp_path: Path) -> None:
    bag = tmp_path / "emergency"
    spoil_decisions(BAGS / "emergency", bag, 3)
    before = (bag / "emergency.mcap").read_bytes()

    done = run("update_bags", "--folder", str(tmp_path))
    assert done.returncode == 1, done.stderr
    assert "emergency: 3 decisions change" in done.stdout
    assert done.stdout.count(" -> ") == 3
    assert "say why" in done.stderr
    assert (bag / "emergency.mcap").read_bytes() == before
    assert not (tmp_path / "CHANGES.md").exists()

    done = run("update_bags", "--folder", str(tmp_path), "--reason", "the actions were spoilt")
    assert done.returncode == 0, done.stderr
    log = (tmp_path / "CHANGES.md").read_text("utf-8")
    assert "the actions were spoilt" in log
    assert "- emergency: 3 decisions" in log
    updated, original = read_bag(bag, RECORDED), read_bag(BAGS / "emergency", RECORDED)
    assert updated.notes == original.notes
    for topic in topics.INPUTS:
        assert updated.of(topic) == original.of(topic)
    assert read_decisions(bag) == read_decisions(BAGS / "emergency")


def test_a_folder_without_bags_cannot_be_updated(tmp_path: Path) -> None:
    done = run("update_bags", "--folder", str(tmp_path))
    assert done.returncode == 2
    assert "holds no bags" in done.stderr
