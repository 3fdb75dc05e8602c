# SPDX-License-Identifier: Apache-2.0
"""A policy node whose policy cannot or must not be used says Stop, and why, twice a second."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest
import torch
from diagnostic_msgs.msg import DiagnosticStatus
from fault_driver import Ears
from intersection_msgs.msg import Decision
from lifecycle_driver import LifecycleDriver

from risk_dqn_planner.policies.network import RiskDqn
from risk_dqn_planner.policies.policy_file import PolicyContract, save_policy
from risk_dqn_planner.policies.shipped import DEFAULT_POLICY, shipped_policies
from sim_bridge.ros import topics
from sim_bridge.ros.process import NodeCommand, NodeProcess
from sim_bridge.ros.session import ros_session, wait_until

pytestmark = [
    pytest.mark.ros,
    pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning"),
]

PATIENCE_S = 180.0
BUSY_S = 0.3


class Refusing:
    """A policy node that is told to use one policy after another."""

    def __init__(self, ears: Ears, process: NodeProcess, life: LifecycleDriver) -> None:
        self.ears, self.process, self.life = ears, process, life

    def refuse(self, path: Path, *, trusted: bool) -> list[tuple[float, Decision]]:
        """Configure it with a file, which must fail; return what it says then, and when."""
        assert self.life.set("policy", str(path)) == "ok"
        assert self.life.set("allow_unlisted_policy", trusted) == "ok"
        assert not self.life.change("configure")
        first = len(self.ears.decisions) + 1  # the one on its way may be of the file before
        wait_until(
            lambda: len(self.ears.decisions) >= first + 4, "decisions", PATIENCE_S,
            self.process.check,
        )  # fmt: skip
        said = zip(self.ears.arrivals_s, self.ears.decisions, strict=False)
        return list(said)[first : first + 4]


@pytest.fixture(scope="module")
def refusing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Refusing]:
    command = NodeCommand(
        "risk_dqn_planner",
        "policy_node",
        {"policy": "no_such_policy"},
        {"~/output/decision": topics.DECISION.name},
    )
    with ros_session("refusals") as node:
        ears = Ears(node)
        process = NodeProcess(command, tmp_path_factory.mktemp("refusals") / "policy_node.log")
        try:
            life = LifecycleDriver(node, "policy", process.check)
            wait_until(
                lambda: "not configured" in process.output(), "the node", PATIENCE_S, process.check
            )
            yield Refusing(ears, process, life)
            process.interrupt()
            assert process.stop() == 0
        finally:
            process.stop(0.0)


def missing(folder: Path) -> Path:
    return folder / "policy.pt"


def text(folder: Path) -> Path:
    path = folder / "policy.pt"
    path.write_text("this is no network")
    return path


def tampered(folder: Path) -> Path:
    """The default policy with one bit changed."""
    data = bytearray(shipped_policies()[DEFAULT_POLICY].path.read_bytes())
    data[len(data) // 2] ^= 1
    path = folder / "policy.pt"
    path.write_bytes(data)
    return path


def cut_short(folder: Path) -> Path:
    path = folder / "policy.pt"
    path.write_bytes(shipped_policies()[DEFAULT_POLICY].path.read_bytes()[:5000])
    return path


def for_another_rate(folder: Path) -> Path:
    path = folder / "policy.pt"
    save_policy(path, RiskDqn(), PolicyContract(name="slower", decision_period_s=1.0))
    return path


def of_another_shape(folder: Path) -> Path:
    path = folder / "policy.pt"
    torch.jit.save(torch.jit.script(torch.nn.Linear(3, 3)), str(path))
    return path


@pytest.mark.parametrize(
    ("make", "trusted", "complaint"),
    [
        (missing, False, "cannot be read"),
        (tampered, False, "which no list of trusted files holds"),
        (for_another_rate, False, "which no list of trusted files holds"),
        (text, True, "is not a TorchScript file"),
        (cut_short, True, "is not a TorchScript file"),
        (for_another_rate, True, "decision_period_s is 1.0, expected 0.5"),
        (of_another_shape, True, "has no contract.json"),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_a_policy_file_that_must_not_be_used_is_refused_by_name(
    refusing: Refusing, tmp_path: Path, make: Callable[[Path], Path], trusted: bool, complaint: str
) -> None:
    said = refusing.refuse(make(tmp_path), trusted=trusted)
    assert {(d.action, d.reason, d.faulty_input) for _, d in said} == {
        (Decision.STOP, Decision.POLICY_REFUSED, Decision.POLICY)
    }
    assert all("policy.pt" in d.text and complaint in d.text for _, d in said), said[-1][1].text
    assert max(after - before for (before, _), (after, _) in pairwise(said)) < 0.5 + BUSY_S
    status = refusing.ears.diagnostics["policy: policy"]
    assert status.level == DiagnosticStatus.ERROR
    assert complaint in status.message
