# SPDX-License-Identifier: Apache-2.0
"""A soak of less than a minute of simulated time, through the real nodes."""

import json
import os
import signal
import subprocess
from pathlib import Path

import pytest
from commands import executable, run

from sim_bridge.ros.session import wait_until

pytestmark = pytest.mark.ros

PATIENCE_S = 300.0
LIGHT = ("--policy", "rule_based", "--scenario", "demo_light")
NODES = {"simulator_node", "situation_node", "policy_node"}


def test_a_short_soak_finds_every_decision_in_its_place_and_measures_all_nodes(
    tmp_path: Path,
) -> None:
    done = run("soak", *LIGHT, "--hours", "0.012", "--out", str(tmp_path))
    found = json.loads((tmp_path / "soak.json").read_text())
    # On a busy computer there are too few samples, or too short a time, to be sure of memory.
    others = [c for c in found["complaints"] if "memory" not in c and "grows" not in c]
    assert others == [], done.stdout + done.stderr
    assert done.returncode == (1 if found["complaints"] else 0)
    assert found["simulated_h"] >= 0.012
    assert found["decisions"] > 40
    assert found["longest_gap_s"] == 0.5
    assert found["late_decisions"] == 0
    assert set(found["series"]["memory_mb"]) == NODES
    assert all(20.0 < mb < 2000.0 for mb in found["series"]["memory_mb"]["policy_node"])
    assert (tmp_path / "memory.png").is_file()


def test_an_interrupted_soak_writes_what_it_has_seen_and_leaves_no_node_behind(
    tmp_path: Path,
) -> None:
    running = subprocess.Popen(
        [executable("soak"), *LIGHT, "--out", str(tmp_path)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"SOAK_STARTED_BY_TEST": str(tmp_path)},
    )
    log = tmp_path / "log" / "policy_node.log"
    wait_until(
        lambda: log.is_file() and "deciding" in log.read_text("utf-8"),
        "decisions",
        PATIENCE_S,
        lambda: None,
    )
    running.send_signal(signal.SIGINT)
    errors = running.communicate(timeout=PATIENCE_S)[1]
    assert running.returncode == 130
    assert "Traceback" not in errors
    assert "interrupted" in errors
    mark = f"SOAK_STARTED_BY_TEST={tmp_path}".encode()
    left = [f for f in Path("/proc").glob("[0-9]*") if mark in environment(f)]
    assert left == []


def environment(process: Path) -> bytes:
    try:
        return (process / "environ").read_bytes()
    except OSError:  # it has just ended, or is not ours
        return b""
