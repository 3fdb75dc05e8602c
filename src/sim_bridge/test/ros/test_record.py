# SPDX-License-Identifier: Apache-2.0
from collections.abc import Iterator
from pathlib import Path

import pytest
from intersection_msgs.msg import Decision, EpisodeEvent
from rclpy.serialization import serialize_message

from risk_dqn_planner.errors import BagError
from risk_dqn_planner.ros.conversions import header
from sim_bridge.ros import record as recorder
from sim_bridge.ros.bag_plan import bags
from sim_bridge.ros.drive import DrivenEpisode
from sim_bridge.ros.expectations import read_decisions, write_decisions
from sim_bridge.ros.recording import Stored
from sim_bridge.ros.topics import DECISION, OBJECTS, SITUATION


def stored(stamp_ms: int, topic: str = OBJECTS.name) -> Stored:
    return Stored(stamp_ms * 1_000_000, topic, b"")


def test_of_the_inputs_those_are_kept_that_decisions_were_taken_on_and_one_between() -> None:
    tenths = [stored(10_000 + 100 * k) for k in range(11)]
    kept = [message.stamp_ns // 1_000_000 for message in recorder.thinned(tenths)]
    assert kept == [10_000, 10_300, 10_500, 10_800, 11_000]


def test_what_is_no_input_is_left_out_of_a_bag() -> None:
    both = [stored(500, SITUATION.name), stored(500, DECISION.name)]
    assert recorder.thinned(both) == [both[1]]


def driven(monkeypatch: pytest.MonkeyPatch, late_decisions: int) -> None:
    """Let an episode of one decision have been driven."""
    decision = Decision(
        header=header(10_000_000_000),
        action=Decision.FAST,
        critical_vehicle_id=Decision.NO_ID,
        critical_lane_id=Decision.NO_ID,
    )
    message = Stored(10_000_000_000, DECISION.name, serialize_message(decision))
    end = EpisodeEvent(event=EpisodeEvent.SUCCESS, late_decisions=late_decisions, duration_s=12.0)

    def drive(*_: object) -> Iterator[DrivenEpisode]:
        yield DrivenEpisode(end, [message])

    monkeypatch.setattr(recorder, "drive", drive)


def test_a_bag_comes_with_what_is_expected_of_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    driven(monkeypatch, late_decisions=0)
    went = recorder.record(bags()["four_way"], tmp_path / "four_way")
    assert went == "success after 12.0 s"
    assert read_decisions(tmp_path / "four_way") == {"10.0": "FAST, CLEAR"}


def test_an_episode_with_late_decisions_is_not_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    driven(monkeypatch, late_decisions=2)
    with pytest.raises(BagError, match="2 decisions came late"):
        recorder.record(bags()["four_way"], tmp_path / "four_way")
    assert not (tmp_path / "four_way").exists()


def folder(path: Path, **decisions: str) -> Path:
    for name, line in decisions.items():
        (path / name).mkdir(parents=True)
        write_decisions(path / name, {"10.0": line})
    return path


def test_changed_decisions_need_a_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = folder(tmp_path / "old", one="FAST, CLEAR", two="STOP, VEHICLE")
    new = folder(tmp_path / "new", one="FAST, CLEAR", two="SLOW, VEHICLE")
    assert not recorder._accepted(new, old, None)
    shown = capsys.readouterr().out
    assert "two: 1 decisions changed" in shown
    assert "t = 10.0 s: STOP, VEHICLE -> SLOW, VEHICLE" in shown
    assert "one" not in shown
    assert not (old / "CHANGES.md").exists()
    assert recorder._accepted(new, old, "slow is enough")
    assert "slow is enough" in (old / "CHANGES.md").read_text()


def test_unchanged_decisions_and_new_bags_need_none(tmp_path: Path) -> None:
    old = folder(tmp_path / "old", one="FAST, CLEAR")
    new = folder(tmp_path / "new", one="FAST, CLEAR", three="STOP, VEHICLE")
    assert recorder._accepted(new, old, None)
