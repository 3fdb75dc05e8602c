# SPDX-License-Identifier: Apache-2.0
"""Every command that takes a bag takes it by its folder and by its name among the bags."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from risk_dqn_planner.errors import BagError
from sim_bridge.ros import replay, update_bags
from sim_bridge.ros.recording import bag_folder
from sim_bridge.ros.story import command as story


def a_bag(path: Path) -> Path:
    path.mkdir(parents=True)
    (path / "metadata.yaml").write_text("")
    return path


def test_a_bag_is_found_by_its_folder_or_by_its_name_among_all_bags(tmp_path: Path) -> None:
    one, apart = a_bag(tmp_path / "bags" / "one"), a_bag(tmp_path / "drives" / "two")
    everything = tmp_path / "bags"
    assert bag_folder(one, everything) == one
    assert bag_folder(Path("one"), everything) == one
    assert bag_folder(Path("one/"), everything) == one
    assert bag_folder(apart, everything) == apart


def test_what_lies_here_is_meant_rather_than_a_bag_of_that_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_bag(tmp_path / "bags" / "one")
    a_bag(tmp_path / "one")
    monkeypatch.chdir(tmp_path)
    assert bag_folder(Path("one")) == Path("one")


def test_what_is_nowhere_is_left_for_its_reader_to_complain_of() -> None:
    assert bag_folder(Path("nowhere")) == Path("nowhere")


@pytest.mark.parametrize("named", ["one", "bags/one", "bags/one/"])
@pytest.mark.parametrize("command", [replay, story, update_bags], ids=lambda c: c.__name__)
def test_commands_take_both(
    command: object, named: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_bag(tmp_path / "bags" / "one")
    monkeypatch.chdir(tmp_path)
    asked: list[Path] = []

    def refuse(path: Path, *_: object) -> None:
        asked.append(path)
        raise BagError(f"{path} is not read in this test")

    def refuse_all(paths: Sequence[Path], *_: object) -> None:
        refuse(paths[0])

    monkeypatch.setattr(replay, "replay", refuse)
    monkeypatch.setattr(story, "read", refuse)
    monkeypatch.setattr(update_bags, "update_all", refuse_all)
    main: Callable[[list[str]], int] = command.main  # type: ignore[attr-defined]
    assert main([named]) == 2
    assert asked == [Path("bags/one")]
