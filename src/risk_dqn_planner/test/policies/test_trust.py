# SPDX-License-Identifier: Apache-2.0
"""TorchScript runs code when it is read: only what is listed, or allowed, is read at all."""

import hashlib
from pathlib import Path

import pytest

from risk_dqn_planner.errors import PolicyFileError
from risk_dqn_planner.policies.loading import load_policy
from risk_dqn_planner.policies.shipped import shipped_policies
from risk_dqn_planner.policies.trust import ANYTHING, Trust, listed

# No TorchScript at all: whoever reads it says so, whoever refuses it unread does not.
DATA = b"whatever this would do"
SHA256 = hashlib.sha256(DATA).hexdigest()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "own.pt").write_bytes(DATA)
    return tmp_path / "own.pt"


def test_a_file_that_is_not_listed_is_refused_unread_and_its_hash_is_told(path: Path) -> None:
    with pytest.raises(PolicyFileError, match=f"own.pt has SHA-256 {SHA256}, which no list"):
        load_policy(str(path), trust=listed())


@pytest.mark.parametrize(
    "further", [SHA256, SHA256.upper(), f"{'0' * 64}, {SHA256}", f"{'0' * 64} {SHA256}"]
)
def test_a_file_whose_hash_is_named_is_read(path: Path, further: str) -> None:
    with pytest.raises(PolicyFileError, match="is not a TorchScript file"):
        load_policy(str(path), trust=listed(further))


def test_a_file_that_is_in_a_list_is_read(path: Path, tmp_path: Path) -> None:
    sums = tmp_path / "SHA256SUMS"
    sums.write_text(f"{'1' * 64}  other.pt\n\n{SHA256}  own.pt\n")
    with pytest.raises(PolicyFileError, match="is not a TorchScript file"):
        load_policy(str(path), trust=listed(str(sums)))


def test_whoever_allows_anything_gets_anything_read(path: Path) -> None:
    with pytest.raises(PolicyFileError, match="is not a TorchScript file"):
        load_policy(str(path), trust=ANYTHING)


def test_the_planner_s_own_policies_are_listed_under_any_path(tmp_path: Path) -> None:
    shipped = shipped_policies()["tuned"]
    copy = tmp_path / "copy.pt"
    copy.write_bytes(shipped.path.read_bytes())
    listed().check(copy, shipped.sha256)
    copy.write_bytes(copy.read_bytes() + b"\0")
    with pytest.raises(PolicyFileError, match="no list of trusted files"):
        load_policy(str(copy), trust=listed())


def test_what_is_neither_hash_nor_list_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(PolicyFileError, match=r"trusted_policies names nowhere/SHA256SUMS"):
        listed("nowhere/SHA256SUMS")
    (tmp_path / "odd").write_text("own.pt is fine\n")
    with pytest.raises(PolicyFileError, match=r"'own.pt is fine' does not begin with a SHA-256"):
        listed(str(tmp_path / "odd"))


def test_trust_in_nothing_refuses_everything() -> None:
    with pytest.raises(PolicyFileError):
        Trust().check("own.pt", SHA256)
