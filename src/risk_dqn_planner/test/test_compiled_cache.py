# SPDX-License-Identifier: Apache-2.0
"""Kernels must not outlive the sources they were compiled from."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import risk_dqn_planner
from risk_dqn_planner.compiled_cache import reached_files

CORE = Path(risk_dqn_planner.__file__).parent

CALLER = """
from risk_dqn_planner.compiled import kernel
from crossing.constants import (
    times,
)

@kernel
def answer() -> int:
    return times(6)
"""
CALLEE = """
from risk_dqn_planner.compiled import kernel

@kernel
def times(number: int) -> int:
    return {factor} * number
"""


def answer_of(folder: Path) -> int:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(CORE.parent)])}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", "from crossing.answers import answer; print(answer())"],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return int(done.stdout)


@pytest.fixture
def package(tmp_path: Path) -> Path:
    folder = tmp_path / "crossing"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "answers.py").write_text(CALLER)
    (folder / "constants.py").write_text(CALLEE.format(factor=7))
    return folder


def test_a_kernel_follows_a_change_in_the_file_of_a_kernel_it_calls(package: Path):
    assert answer_of(package.parent) == 42
    (package / "constants.py").write_text(CALLEE.format(factor=9))
    assert answer_of(package.parent) == 54


def test_kernels_are_kept_in_the_package_and_found_again(package: Path):
    answer_of(package.parent)
    kept = {path: path.stat().st_mtime_ns for path in package.rglob("*.nbc")}
    assert kept
    answer_of(package.parent)
    assert {path: path.stat().st_mtime_ns for path in package.rglob("*.nbc")} == kept


def test_reached_files_follow_imports_and_leave_others_out():
    files = {
        path.relative_to(CORE).as_posix() for path in reached_files("risk_dqn_planner.risk.risk")
    }
    assert {"risk/risk.py", "risk/motion.py", "risk/worst_case.py", "compiled.py"} <= files
    assert "policies/rule_based.py" not in files
