# SPDX-License-Identifier: Apache-2.0
"""Bags of other stacks through the adapters to the real nodes: the same decisions come out."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from commands import run
from foreign_bags import (
    KINDS,
    OBJECT_ARRAY,
    TRACKED_OBJECTS,
    TYPES,
    Message,
    header,
    uuid_of,
    write_bag,
)
from intersection_msgs.msg import Decision, PerceivedObjects
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.rosbag2 import StoragePlugin

from risk_dqn_planner.ros.adapters.autoware import id_of_uuid
from sim_bridge.ros import topics
from sim_bridge.ros.recording import Stored, installed_types, read_bag

BAGS = Path(__file__).resolve().parents[1] / "bags"
RECORDED = (*topics.INPUTS, topics.DECISION)
AUTOWARE_NAMES = {
    "/odometry": "/localization/kinematic_state",
    "/objects": "/perception/object_recognition/tracking/objects",
}
LATER_NS = 40_000_000  # messages arrive later than the time in their header


def unchanged(message: Message) -> Message:
    return message


def as_recorded_elsewhere(
    source: str,
    path: Path,
    kind: str,
    *,
    names: dict[str, str] | None = None,
    left_out: tuple[str, ...] = (),
    later_ns: int = 0,
    plugin: StoragePlugin = StoragePlugin.MCAP,
    change: Callable[[Message], Message] = unchanged,
) -> None:
    """Write one of the project's bags with its objects in another stack's type."""
    bag = read_bag(BAGS / source, RECORDED)
    types = installed_types()
    messages = []
    for message in bag.messages:
        if message.topic in left_out:
            continue
        topic = next(t for t in RECORDED if t.name == message.topic)
        type_name, data = topic.type_name, message.data
        if topic is topics.OBJECTS:
            own = types.deserialize_cdr(data, type_name)
            type_name = kind
            data = bytes(TYPES.serialize_cdr(change(KINDS[kind](own)), kind))
        elif topic is topics.DECISION and kind == TRACKED_OBJECTS:
            data = with_ids_of_uuids(data)
        name = (names or {}).get(topic.name, topic.name)
        messages.append((message.stamp_ns + later_ns, name, type_name, data))
    write_bag(path, messages, dict(bag.notes), plugin, own_types=types)


def with_ids_of_uuids(data: bytes) -> bytes:
    """A decision about the vehicle that has a UUID in place of its id."""
    decision = deserialize_message(data, Decision)
    if decision.critical_vehicle_id != Decision.NO_ID:
        uuid = uuid_of(decision.critical_vehicle_id)
        decision.critical_vehicle_id = id_of_uuid(uuid.bytes)
    return bytes(serialize_message(decision))


@pytest.mark.ros
@pytest.mark.parametrize("kind", [TRACKED_OBJECTS, OBJECT_ARRAY])
def test_the_nodes_decide_on_another_stacks_objects_as_on_their_own(
    kind: str, tmp_path: Path
) -> None:
    as_recorded_elsewhere("four_way", tmp_path / "bag", kind)
    done = run("replay", str(tmp_path / "bag"))
    assert done.returncode == 0, done.stdout + done.stderr
    recorded = len(read_bag(BAGS / "four_way", RECORDED).of(topics.DECISION))
    assert f"{recorded} of {recorded} decisions as recorded" in done.stdout


def without_vehicle(described: str) -> list[str]:
    """What is expected, but for which vehicle it is about."""
    return [part for part in described.split(", ") if not part.startswith("vehicle ")]


@pytest.mark.ros
def test_a_bag_of_autoware_becomes_one_to_replay(tmp_path: Path) -> None:
    source = tmp_path / "autoware"
    as_recorded_elsewhere(
        "four_way",
        source,
        TRACKED_OBJECTS,
        names=AUTOWARE_NAMES,
        left_out=("/route", "/decision"),
        later_ns=LATER_NS,
        plugin=StoragePlugin.SQLITE3,
    )
    target = tmp_path / "own"
    done = run(
        "convert", str(source), str(target), "--map", "four_way", "--policy", "rule_based",
        "--supervisor", "off", "--scenario", "demo_light",
        "--odometry-topic", AUTOWARE_NAMES["/odometry"],
        "--objects-topic", AUTOWARE_NAMES["/objects"], "--visible-area-topic", "/visible_area",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    ours, theirs = read_bag(BAGS / "four_way", RECORDED), read_bag(target, RECORDED)
    for topic in (topics.ODOMETRY, topics.VISIBLE_AREA, topics.OBJECTS):
        # By the time in their headers again, whenever they arrived.
        expected = [message.stamp_ns for message in ours.of(topic)]
        assert [message.stamp_ns for message in theirs.of(topic)] == expected
    assert_same_vehicles(ours.of(topics.OBJECTS), theirs.of(topics.OBJECTS))
    assert run("replay", str(target)).returncode == 2  # no decisions to compare with yet
    done = run("update_bags", str(target), "--reason", "first decisions on this bag")
    assert done.returncode == 0, done.stderr
    assert "first decisions on this bag" in (tmp_path / "CHANGES.md").read_text()
    before = (BAGS / "four_way" / "decisions.txt").read_text().splitlines()
    now = (target / "decisions.txt").read_text().splitlines()
    assert [without_vehicle(line) for line in now] == [without_vehicle(line) for line in before]


def assert_same_vehicles(ours: Sequence[Stored], theirs: Sequence[Stored]) -> None:
    found = 0
    for one, other in zip(ours, theirs, strict=True):
        mine = deserialize_message(one.data, PerceivedObjects).objects
        yours = deserialize_message(other.data, PerceivedObjects).objects
        assert len(mine) == len(yours)
        for a, b in zip(mine, yours, strict=True):
            found += 1
            assert (b.x_m, b.y_m) == pytest.approx((a.x_m, a.y_m), abs=1e-9)
            turned = (b.heading_rad - a.heading_rad + math.pi) % math.tau - math.pi
            assert turned == pytest.approx(0.0, abs=1e-9)
            assert b.speed_mps == pytest.approx(a.speed_mps, abs=1e-9)
            assert (b.length_m, b.width_m) == (a.length_m, a.width_m)
    assert found > 50


def without_visible_area(path: Path, change: Callable[[Message], Message] = unchanged) -> None:
    left_out = ("/route", "/decision", "/visible_area")
    as_recorded_elsewhere("four_way", path, TRACKED_OBJECTS, left_out=left_out, change=change)


def test_nothing_is_taken_for_seen_unless_the_user_says_so(tmp_path: Path) -> None:
    without_visible_area(tmp_path / "bag")
    done = run("convert", str(tmp_path / "bag"), str(tmp_path / "own"))
    assert done.returncode == 2
    assert "nothing says what the sensors saw" in done.stderr
    done = run("convert", str(tmp_path / "bag"), str(tmp_path / "own"), "--visible-range", "50")
    assert done.returncode == 0, done.stderr
    areas = read_bag(tmp_path / "own", RECORDED).of(topics.VISIBLE_AREA)
    area = installed_types().deserialize_cdr(areas[0].data, topics.VISIBLE_AREA.type_name)
    corners = np.array([(p.x, p.y) for p in area.polygon.points])
    middle = corners.mean(axis=0)
    assert np.hypot(*(corners - middle).T) == pytest.approx(50.0, abs=0.01)


def with_broken_orientation(message: Message) -> Message:
    for each in message.objects:  # none as long as nobody is in sight
        each.kinematics.pose_with_covariance.pose.orientation.w = 7.0
    return message


@pytest.mark.parametrize(
    ("options", "change", "complaint"),
    [
        (["--objects-topic", "/cars"], unchanged, "lacks the topic /cars"),
        (["--odometry-topic", "/objects"], unchanged, "/objects in"),
        ([], with_broken_orientation, "orientation has norm"),
    ],
)
def test_what_is_wrong_with_a_foreign_bag_is_said_in_one_sentence(
    options: list[str], change: Callable[[Message], Message], complaint: str, tmp_path: Path
) -> None:
    without_visible_area(tmp_path / "bag", change)
    done = run(
        "convert", str(tmp_path / "bag"), str(tmp_path / "own"), "--visible-range", "50", *options
    )
    assert done.returncode == 2, done.stdout
    assert complaint in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "own").exists()


def test_an_empty_list_of_either_stack_is_read(tmp_path: Path) -> None:
    for kind in KINDS:
        path = tmp_path / kind.split("/")[0]
        empty = TYPES.types[kind](header=header(5 * 10**8), objects=[])
        write_bag(path, [(10**9, "/objects", kind, bytes(TYPES.serialize_cdr(empty, kind)))], {})
        messages = read_bag(path, [topics.OBJECTS]).messages
        own = deserialize_message(messages[0].data, PerceivedObjects)
        assert (own.header.frame_id, own.header.stamp.nanosec, list(own.objects)) == (
            "map", 5 * 10**8, [],
        )  # fmt: skip
