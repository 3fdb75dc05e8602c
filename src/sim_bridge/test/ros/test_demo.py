# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest

from sim_bridge.ros.demo import main


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--map", "nowhere.osm", "--route", "1,2", "--origin", "49.0,8.4"], "nowhere.osm"),
        (["--map", "atlantis"], "'atlantis'"),
        (["--route", "1,424242"], "424242"),
        (["--route", "left"], "'left'"),
        (["--origin", "0.0,0.0"], "km from the origin"),
        (["--projector", "globe"], "'globe'"),
        (["--scenario", "rush_hour"], "'rush_hour'"),
        (["--policy", "nobody"], "'nobody'"),
        (["--supervisor", "strict"], "'strict'"),
        (["--memory", "perfect"], "'perfect'"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else None,
)
def test_a_wrong_option_is_named_in_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: list[str], complaint: str
) -> None:
    assert main([*options, "--out", str(tmp_path)]) == 2
    errors = capsys.readouterr().err
    assert complaint in errors
    assert len(errors.strip().splitlines()) == 1, errors


def test_a_folder_that_cannot_be_written_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("in the way")
    assert main(["--out", str(tmp_path / "file" / "demo")]) == 2
    assert "cannot write to" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "expected"),
    [
        ("--episodes=0", "--episodes: '0' is out of range, expected a whole number from 1"),
        ("--episodes=abc", "argument --episodes: 'abc' is out of range"),
        ("--seed=-1", "argument --seed: '-1' is out of range, expected a whole number from 0"),
        ("--seed=99999999999999999999", "to 9223372036854775807"),
        ("--rate=-1", "argument --rate: '-1' is out of range, expected a number from 0 to 1000"),
        ("--rate=nan", "argument --rate: 'nan' is out of range"),
    ],
)
def test_numbers_out_of_range_are_refused_by_name(
    capsys: pytest.CaptureFixture[str], option: str, expected: str
) -> None:
    with pytest.raises(SystemExit) as end:
        main([option])
    assert end.value.code == 2
    assert expected in capsys.readouterr().err
