# SPDX-License-Identifier: Apache-2.0
"""Policy files come back as they were saved, and are refused by name where they do not fit."""

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import pytest
import torch

from risk_dqn_planner.errors import PolicyFileError
from risk_dqn_planner.policies.network import OutlookDqn, RiskDqn
from risk_dqn_planner.policies.outlook import OutlookConfig
from risk_dqn_planner.policies.policy_file import (
    PolicyContract,
    load_policy_file,
    save_policy,
)
from risk_dqn_planner.state.encoding import StateConfig
from risk_dqn_planner.vehicle import EgoLimits

pytestmark = pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")

CONTRACT = PolicyContract(
    name="test_policy", maps=("four_way",), training={"seed": 3}, git_revision="abc"
)


def make_network(seed: int = 0) -> RiskDqn:
    torch.manual_seed(seed)
    return RiskDqn()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    save_policy(tmp_path / "policy.pt", make_network(), CONTRACT)
    return tmp_path / "policy.pt"


class Rewritten:
    """The policy file's network saved again, with another contract."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.files = {"contract.json": ""}
        self.module: Any = torch.jit.load(  # type: ignore[no-untyped-call]
            str(path), _extra_files=self.files
        )
        self.contract: dict[str, Any] = json.loads(self.files["contract.json"])

    def save(self, text: str | None = None) -> None:
        files = {"contract.json": json.dumps(self.contract) if text is None else text}
        torch.jit.save(self.module, str(self.path), _extra_files=files)


def test_a_policy_comes_back_as_it_was_saved(path: Path, tmp_path: Path) -> None:
    file = load_policy_file(path)
    assert file.name == "test_policy"
    assert file.contract["maps"] == ["four_way"]
    assert file.contract["training"] == {"seed": 3}
    assert file.contract["git_revision"] == "abc"
    assert file.contract["actions"] == ["STOP", "SLOW", "FAST"]
    state = torch.rand(2, 5, 3, 8)
    torch.testing.assert_close(file.module(state), make_network()(state))
    assert save_policy(tmp_path / "again.pt", make_network(), CONTRACT) == file.sha256


def test_a_network_is_saved_where_others_of_its_class_track_gradients(path: Path) -> None:
    class Trained(RiskDqn):
        """A class of its own: torch compiles and specialises once for all of a class."""

    scripted = torch.jit.script(Trained())
    for batch in (1, 7):
        scripted(torch.rand(batch, 5, 3, 8))
    sha256 = save_policy(path, Trained(), CONTRACT)
    assert load_policy_file(path).sha256 == sha256


def test_a_policy_file_does_not_name_the_machine_it_was_made_on(path: Path) -> None:
    source = str(Path(__file__).resolve().parents[2]).encode()
    with zipfile.ZipFile(path) as archive:
        assert not [n for n in archive.namelist() if source in archive.read(n)]


def refuses(path: Path, *words: str, expected: PolicyContract | None = None) -> None:
    with pytest.raises(PolicyFileError) as caught:
        load_policy_file(path, expected)
    for word in (str(path), *words):
        assert word in str(caught.value)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    refuses(tmp_path / "none.pt", "cannot be read")


@pytest.mark.parametrize("kind", ["text", "weights", "truncated"])
def test_what_is_no_torchscript_is_refused(path: Path, kind: str) -> None:
    if kind == "text":
        path.write_text("no network")
    elif kind == "weights":
        torch.save(make_network().state_dict(), path)
    else:
        path.write_bytes(path.read_bytes()[:5000])
    refuses(path, "not a TorchScript file")


def test_a_file_without_contract_is_refused(path: Path) -> None:
    torch.jit.save(Rewritten(path).module, str(path))
    refuses(path, "has no contract.json")


@pytest.mark.parametrize("text", ["{", "[]", "{}"])
def test_a_damaged_contract_is_refused(path: Path, text: str) -> None:
    Rewritten(path).save(text)
    refuses(path, "contract.json")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("format_version", 2),
        ("state_layout", "grid"),
        ("state_shape", [5, 3, 9]),
        ("actions", ["SLOW", "STOP", "FAST"]),
        ("target_speeds_mps", [0.0, 1.0, 8.0]),
        ("decision_period_s", 0.1),
    ],
)
def test_another_interface_is_refused_by_name(path: Path, name: str, value: object) -> None:
    rewritten = Rewritten(path)
    rewritten.contract[name] = value
    rewritten.save()
    refuses(path, f"{name} is {value}")
    del rewritten.contract[name]
    rewritten.save()
    refuses(path, f"{name} is None")


def test_another_normalisation_is_refused_by_name(path: Path) -> None:
    for state, words in (
        (StateConfig(vehicle_max_m=50.0), "normalisation.vehicle_max_m is 70.0, expected 50.0"),
        (StateConfig(stacked=True), "normalisation.stacked is False, expected True"),
    ):
        refuses(path, words, expected=PolicyContract(name="", state=state))
    fast = PolicyContract(name="", ego=EgoLimits(fast_mps=6.0))
    refuses(path, "target_speeds_mps is [0.0, 1.0, 5.0], expected [0.0, 1.0, 6.0]", expected=fast)
    rewritten = Rewritten(path)
    rewritten.contract["normalisation"]["lane_max_m"] = 3.0
    rewritten.save()
    refuses(path, "normalisation.lane_max_m is 3.0, expected None")


def test_a_network_that_computes_something_else_is_refused(path: Path) -> None:
    rewritten = Rewritten(path)
    rewritten.contract["golden"]["q_values"][1][2] += 0.01
    rewritten.save()
    refuses(path, "for the golden state")


@pytest.mark.parametrize("golden", [None, {}, {"state": [[1.0], [1.0, 2.0]], "q_values": []}])
def test_a_file_without_golden_pair_is_refused(path: Path, golden: object) -> None:
    rewritten = Rewritten(path)
    rewritten.contract["golden"] = golden
    rewritten.save()
    refuses(path, "no golden state")


def test_a_golden_state_of_another_shape_is_refused(path: Path) -> None:
    rewritten = Rewritten(path)
    rewritten.contract["golden"]["state"] = [[1.0, 2.0]]
    rewritten.save()
    refuses(path, "the golden state has shape (1, 2)")


class Lopsided(torch.nn.Module):
    """Returns four values for three actions."""

    def forward(self, state: torch.Tensor) -> torch.Tensor:
        return state.flatten(1)[:, :4]


class Narrow(torch.nn.Module):
    """Takes flat states only."""

    def __init__(self) -> None:
        super().__init__()
        self.layer = torch.nn.Linear(120, 3)

    def forward(self, state: torch.Tensor) -> torch.Tensor:
        values: torch.Tensor = self.layer(state)
        return values


@pytest.mark.parametrize(
    ("network", "words"),
    [(Lopsided(), "returns shape (2, 4), expected (2, 3)"), (Narrow(), "cannot take states")],
)
def test_a_network_of_another_shape_is_refused(
    path: Path, network: torch.nn.Module, words: str
) -> None:
    rewritten = Rewritten(path)
    rewritten.module = torch.jit.script(network)
    rewritten.save()
    refuses(path, words)


def test_saving_a_network_leaves_it_in_its_mode(tmp_path: Path) -> None:
    network = make_network().train()
    save_policy(tmp_path / "policy.pt", network, CONTRACT)
    assert network.training


def test_the_file_is_small(path: Path) -> None:
    assert path.stat().st_size < 1_000_000
    assert zipfile.is_zipfile(io.BytesIO(path.read_bytes()))


OUTLOOK = OutlookConfig(periods=5)


@pytest.fixture
def with_outlook(tmp_path: Path) -> Path:
    contract = PolicyContract(name="far_sighted", outlook=OUTLOOK)
    save_policy(tmp_path / "outlook.pt", OutlookDqn(OUTLOOK.size), contract)
    return tmp_path / "outlook.pt"


def test_an_outlook_comes_back_as_it_was_saved(with_outlook: Path, path: Path) -> None:
    file = load_policy_file(with_outlook)
    assert file.outlook == OUTLOOK
    assert file.module(torch.rand(2, 5, 3, 8), torch.rand(2, OUTLOOK.size)).shape == (2, 3)
    assert load_policy_file(path).outlook is None


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("outlook_layout", "something else", "outlook_layout is something else"),
        ("outlook", {"periods": 0}, "outlook cannot be used: OutlookConfig.periods is 0"),
        ("outlook", {"colour": 1}, "outlook cannot be used"),
        ("outlook", {**vars(OUTLOOK), "periods": 4}, "the golden outlook has shape (2, 70)"),
    ],
)
def test_an_outlook_that_this_program_cannot_give_is_refused(
    with_outlook: Path, field: str, value: object, words: str
) -> None:
    rewritten = Rewritten(with_outlook)
    rewritten.contract[field] = value
    rewritten.save()
    refuses(with_outlook, words)
