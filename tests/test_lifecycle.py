# SPDX-License-Identifier: Apache-2.0
"""The managed nodes over their services: every state, what may change in it, and its end."""

import hashlib
import os
import signal
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from intersection_msgs.msg import Decision
from lifecycle_driver import LifecycleDriver
from rclpy.node import Node

from risk_dqn_planner.policies.shipped import shipped_policies
from sim_bridge.ros import topics
from sim_bridge.ros.process import NodeCommand, NodeProcess
from sim_bridge.ros.run_settings import RunSettings
from sim_bridge.ros.session import wait_until

pytestmark = pytest.mark.ros

PATIENCE_S = 240.0
END_S = 20.0
SITUATION, POLICY = 0, 1
Manage = Callable[..., tuple[NodeProcess, LifecycleDriver]]


@pytest.fixture
def manage(
    node: Node, start: Callable[[NodeCommand], NodeProcess], settings: RunSettings
) -> Manage:
    """Starts a node that waits for its manager, and gives both."""

    def start_one(which: int, **overrides: object) -> tuple[NodeProcess, LifecycleDriver]:
        parameters = {"use_sim_time": False, "autostart": False, **overrides}
        chosen = replace(settings, policy="rule_based", supervisor="off", overrides=parameters)
        process = start(chosen.planner_commands()[which])
        return process, LifecycleDriver(node, ("situation", "policy")[which], process.check)

    return start_one


@pytest.fixture
def decisions(node: Node) -> list[Decision]:
    """All decisions that are heard from now on."""
    heard: list[Decision] = []
    node.create_subscription(Decision, topics.DECISION.name, heard.append, topics.DECISION.qos)
    return heard


def end(process: NodeProcess, number: int) -> int:
    os.kill(process.pid, number)
    wait_until(lambda: process.exit_code is not None, "the end", END_S, lambda: None)
    assert "Traceback" not in process.output(), process.output()
    assert process.exit_code is not None
    return process.exit_code


@pytest.mark.parametrize("which", [SITUATION, POLICY], ids=["situation", "policy"])
def test_a_node_goes_through_all_its_states_and_back(manage: Manage, which: int) -> None:
    process, life = manage(which)
    seen = [life.state()]
    for transition in ("configure", "activate", "deactivate", "cleanup", "configure", "activate"):
        assert life.change(transition), process.output()
        seen.append(life.state())
    expected = ["unconfigured", "inactive", "active", "inactive", "unconfigured"]
    assert seen == [*expected, "inactive", "active"]
    assert life.change("shutdown")
    wait_until(lambda: process.exit_code is not None, "the end", END_S, lambda: None)
    assert process.exit_code == 0, process.output()


@pytest.mark.parametrize("which", [SITUATION, POLICY], ids=["situation", "policy"])
def test_a_transition_that_the_state_does_not_have_is_refused_and_harms_nobody(
    manage: Manage, which: int
) -> None:
    process, life = manage(which)
    for transition in ("activate", "cleanup", "no_such_transition"):
        assert not life.change(transition)
    assert life.state() == "unconfigured"
    assert "Traceback" not in process.output()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda s: s.name)
@pytest.mark.parametrize("state", ["unconfigured", "configuring", "inactive", "active"])
def test_a_node_that_is_asked_to_end_ends_without_an_error_in_every_state(
    manage: Manage, state: str, number: signal.Signals
) -> None:
    process, life = manage(POLICY, policy="tuned" if state == "configuring" else "rule_based")
    if state == "configuring":
        life.request("configure")
    elif state != "unconfigured":
        assert life.change("configure")
    if state == "active":
        assert life.change("activate")
    life.await_state(state)
    assert end(process, number) == 0, process.output()


@pytest.mark.parametrize("state", ["unconfigured", "inactive", "active"])
def test_so_does_the_situation_node(manage: Manage, state: str) -> None:
    process, life = manage(SITUATION)
    for transition in {"inactive": ["configure"], "active": ["configure", "activate"]}.get(
        state, []
    ):
        assert life.change(transition)
    assert life.state() == state
    assert end(process, signal.SIGTERM) == 0, process.output()


@pytest.mark.parametrize("which", [SITUATION, POLICY], ids=["situation", "policy"])
def test_so_does_a_node_that_says_why_it_could_not_be_configured(
    manage: Manage, which: int
) -> None:
    wrong = {"map_file": "/no/such/map.osm", "policy": "no_such_policy", "autostart": True}
    process, life = manage(which, **wrong)
    wait_until(lambda: "not configured" in process.output(), "why", PATIENCE_S, process.check)
    assert life.state() == "unconfigured"
    assert end(process, signal.SIGTERM) == 0, process.output()


def test_a_managed_policy_decides_while_it_is_active_and_at_no_other_time(
    decisions: list[Decision], manage: Manage
) -> None:
    process, life = manage(POLICY)
    assert life.change("configure")
    assert decisions == []
    assert life.change("activate")
    wait_until(lambda: len(decisions) >= 3, "decisions", PATIENCE_S, process.check)
    assert life.change("deactivate")
    seen = len(decisions)
    life.state()
    assert len(decisions) <= seen + 1
    assert {(d.action, d.reason) for d in decisions} == {(Decision.STOP, Decision.MISSING_INPUT)}


def test_what_cannot_be_configured_stays_unconfigured_until_it_is_corrected(
    manage: Manage, settings: RunSettings
) -> None:
    process, life = manage(SITUATION, map_file="/no/such/map.osm")
    assert not life.change("configure")
    assert life.state() == "unconfigured"
    lines = [line for line in process.output().splitlines() if "not configured: " in line]
    assert len(lines) == 1
    assert "/no/such/map.osm does not exist" in lines[0]
    assert life.set("map_file", str(settings.map_file)) == "ok"
    assert life.change("configure"), process.output()
    assert life.state() == "inactive"


def test_a_refused_policy_goes_on_saying_stop_until_another_one_is_configured(
    decisions: list[Decision], manage: Manage
) -> None:
    process, life = manage(POLICY, policy="no_such_policy", autostart=True)

    def newest() -> int | None:
        return decisions[-1].reason if decisions else None

    wait_until(lambda: newest() == Decision.POLICY_REFUSED, "refusal", PATIENCE_S, process.check)
    assert life.state() == "unconfigured"
    assert life.set("policy", "rule_based") == "ok"
    assert life.change("configure"), process.output()
    assert life.change("activate")
    wait_until(lambda: newest() == Decision.MISSING_INPUT, "MISSING", PATIENCE_S, process.check)
    assert {decision.action for decision in decisions} == {Decision.STOP}


def test_a_policy_that_is_configured_again_does_not_decide_before_it_is_active(
    decisions: list[Decision], manage: Manage
) -> None:
    process, life = manage(POLICY, policy="no_such_policy", autostart=True)

    def said() -> set[int]:
        return {decision.reason for decision in decisions}

    wait_until(lambda: Decision.POLICY_REFUSED in said(), "refusal", PATIENCE_S, process.check)
    assert life.set("policy", "rule_based") == "ok"
    assert life.change("configure"), process.output()
    decisions.clear()
    wait_until(lambda: len(decisions) >= 3, "decisions", PATIENCE_S, process.check)
    # Asked, it would say that inputs are missing.
    assert said() == {Decision.POLICY_NOT_READY}
    assert "not active" in decisions[-1].text
    assert life.change("activate")
    wait_until(lambda: Decision.MISSING_INPUT in said(), "MISSING", PATIENCE_S, process.check)


def test_a_policy_node_without_a_manager_is_not_silent_after_a_configuration_that_failed(
    decisions: list[Decision], manage: Manage
) -> None:
    process, life = manage(POLICY, autostart=True)
    life.await_state("active")
    for transition in ("deactivate", "cleanup"):
        assert life.change(transition)
    assert life.set("policy", "no_such_policy") == "ok"
    decisions.clear()
    assert not life.change("configure")
    wait_until(lambda: len(decisions) >= 2, "decisions", 5.0, process.check)
    assert {decision.reason for decision in decisions} == {Decision.POLICY_REFUSED}


def test_values_that_contradict_each_other_are_told_of_when_the_node_is_configured(
    manage: Manage,
) -> None:
    process, life = manage(SITUATION)
    assert life.set("rates.objects.min_rate_hz", 500.0) == "ok"
    assert not life.change("configure")
    assert "min_rate_hz is 500.0" in process.output()
    assert life.set("rates.objects.max_rate_hz", 1000.0) == "ok"
    assert life.change("configure"), process.output()
    assert "Traceback" not in process.output()


@pytest.mark.parametrize("state", ["unconfigured", "inactive"])
def test_parameters_cannot_be_deleted(manage: Manage, state: str) -> None:
    process, life = manage(POLICY)
    if state == "inactive":
        assert life.change("configure")
    for name in ("recovery_s", "policy"):
        assert life.set(name, None) != "ok"
    assert "Traceback" not in process.output()
    assert life.set("recovery_s", 2.0) == "ok"


def test_a_policy_file_is_loaded_only_once_its_hash_is_trusted(
    manage: Manage, tmp_path: Path
) -> None:
    # The planner's own file with a byte more: TorchScript still, but nobody's.
    data = shipped_policies()["tuned"].path.read_bytes() + b"\0"
    own = tmp_path / "own.pt"
    own.write_bytes(data)
    sha256 = hashlib.sha256(data).hexdigest()
    process, life = manage(POLICY, policy=str(own))
    assert not life.change("configure")
    assert f"own.pt has SHA-256 {sha256}, which no list" in process.output()
    assert life.set("trusted_policies", sha256) == "ok"
    life.change("configure")
    assert process.output().count("which no list") == 1


def test_parameters_change_at_once_or_are_refused_with_the_reason(manage: Manage) -> None:
    _, life = manage(POLICY)
    assert life.change("configure")
    assert life.set("max_situation_age_s", 0.3) == "ok"
    assert life.set("supervisor", "enforce") == "ok"
    refusal = life.set("policy", "always_stop")
    assert refusal.startswith("parameter policy may change while the node is unconfigured, but")
    assert "inactive" in refusal
    assert life.set("supervisor", "strict").startswith("supervisor is 'strict', expected one of")
    assert "recovery_s" in life.set("recovery_s", 1e9)
