# SPDX-License-Identifier: Apache-2.0
"""Policy files: a TorchScript network that carries the contract it was trained under.

The contract says what the network must be given (state layout, normalisation, rate), what its
outputs mean (actions, target speeds), where it comes from, and one input with its output. A file
that breaks it is refused by name: a network fed with the wrong numbers would still answer.
"""

import copy
import dataclasses
import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from risk_dqn_planner.errors import ConfigurationError, PolicyFileError
from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.policies.outlook import LAYOUT as OUTLOOK_LAYOUT
from risk_dqn_planner.policies.outlook import OutlookConfig
from risk_dqn_planner.policies.trust import ANYTHING, Trust
from risk_dqn_planner.state.encoding import COLUMNS, LAYOUT, ROWS, SCENES, StateConfig
from risk_dqn_planner.vehicle import EgoLimits

FORMAT_VERSION = 1
CONTRACT = "contract.json"
STATE_SHAPE = [SCENES, ROWS, COLUMNS]
# Other processors and versions of torch may sum in another order.
GOLDEN_TOLERANCE = 1e-4


@dataclass(frozen=True)
class PolicyContract:
    """What a policy was trained for.

    outlook: what the network is told beyond the state, None for nothing.
    maps: names of the maps trained on. training: configuration, seed and results as the trainer
    wants them kept, JSON only. git_revision: of the code that trained it.
    """

    name: str
    state: StateConfig = field(default_factory=StateConfig)
    ego: EgoLimits = field(default_factory=EgoLimits)
    decision_period_s: float = 0.5
    maps: tuple[str, ...] = ()
    training: Mapping[str, Any] = field(default_factory=dict)
    git_revision: str = "unknown"
    outlook: OutlookConfig | None = None

    def requirements(self) -> dict[str, Any]:
        """Return what must be the same where the policy runs."""
        return {
            "format_version": FORMAT_VERSION,
            "state_layout": LAYOUT,
            "state_shape": STATE_SHAPE,
            "normalisation": dataclasses.asdict(self.state),
            "actions": [action.name for action in Action],
            "target_speeds_mps": [0.0, self.ego.slow_mps, self.ego.fast_mps],
            "decision_period_s": self.decision_period_s,
        }


@dataclass(frozen=True)
class PolicyFile:
    """A loaded policy file: its network, all that its contract says, and the file's SHA-256.

    outlook: what the network is told beyond the state, None for nothing.
    """

    name: str
    module: torch.jit.ScriptModule
    contract: Mapping[str, Any]
    sha256: str
    outlook: OutlookConfig | None = None


def save_policy(path: Path | str, network: torch.nn.Module, contract: PolicyContract) -> str:
    """Write a policy file and return its SHA-256; the same network gives the same file."""
    # Read back, a module shares no compiled code with others of its class, as in the vehicle:
    # what torch specialised for one that is being trained fails where nothing is tracked.
    scripted = _without_origin(torch.jit.script(copy.deepcopy(network).eval()))
    inputs = _golden_inputs(contract.outlook)
    values = _evaluate(scripted, *inputs.values())
    document = {
        "name": contract.name,
        **contract.requirements(),
        "maps": list(contract.maps),
        "training": dict(contract.training),
        "git_revision": contract.git_revision,
        "golden": {name: each.tolist() for name, each in {**inputs, "q_values": values}.items()},
    }
    if contract.outlook is not None:
        document["outlook_layout"] = OUTLOOK_LAYOUT
        document["outlook"] = dataclasses.asdict(contract.outlook)
    text = json.dumps(document, indent=1, sort_keys=True)
    data = _serialise(scripted, {CONTRACT: text})
    Path(path).write_bytes(data)
    return hashlib.sha256(data).hexdigest()


def load_policy_file(
    path: Path | str,
    expected: PolicyContract | None = None,
    sha256: str | None = None,
    trust: Trust = ANYTHING,
) -> PolicyFile:
    """Read a policy file and check it against what is expected here (by default: the defaults).

    sha256: of the file, where it is known; any other file is refused unread. trust: in which
    files, since reading one runs its code; any other is refused unread, too.
    Raises PolicyFileError if the file is missing, is another one, is not trusted, is no
    TorchScript, has no contract, was trained for another state, other actions or another rate, or
    does not compute what it did.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise PolicyFileError(f"policy file {path} cannot be read: {error.strerror}") from error
    found = hashlib.sha256(data).hexdigest()
    if found != (sha256 or found):
        raise PolicyFileError(f"policy file {path} has SHA-256 {found}, expected {sha256}")
    trust.check(path, found)
    files = {CONTRACT: ""}
    try:
        module = _deserialise(data, files)
    except (RuntimeError, ValueError) as error:
        raise PolicyFileError(f"policy file {path} is not a TorchScript file") from error
    contract = _read_contract(path, files[CONTRACT])
    for name, value in (expected or PolicyContract(name="")).requirements().items():
        _require_equal(path, name, contract.get(name), value)
    outlook = _read_outlook(path, contract)
    _check_golden(path, module.eval(), contract, outlook)
    return PolicyFile(str(contract["name"]), module, contract, found, outlook)


def _serialise(module: torch.jit.ScriptModule, files: dict[str, str]) -> bytes:
    """Save through a buffer, since torch writes a file's own name into the file."""
    buffer = io.BytesIO()
    torch.jit.save(module, buffer, _extra_files=files)
    return buffer.getvalue()


def _deserialise(data: bytes, files: dict[str, str]) -> torch.jit.ScriptModule:
    module: torch.jit.ScriptModule = torch.jit.load(  # type: ignore[no-untyped-call]
        io.BytesIO(data), map_location="cpu", _extra_files=files
    )
    return module


def _without_origin(module: torch.jit.ScriptModule) -> torch.jit.ScriptModule:
    """Forget which source files a module was compiled from, paths of the machine included."""
    stripped = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(_serialise(module, {}))) as source,
        zipfile.ZipFile(stripped, "w") as target,
    ):
        for name in source.namelist():
            if not name.endswith(".debug_pkl"):
                target.writestr(name, source.read(name))
    return _deserialise(stripped.getvalue(), {})


def _golden_inputs(outlook: OutlookConfig | None) -> dict[str, NDArray[np.float32]]:
    """Return some states (2, 5, 3, 8) that are nothing in particular, and outlooks (2, E)."""
    random = np.random.default_rng(0)
    shapes = {name: (2, *shape) for name, shape in _input_shapes(outlook).items()}
    return {
        name: random.uniform(-1.0, 1.0, shape).round(4).astype(np.float32)
        for name, shape in shapes.items()
    }


def _input_shapes(outlook: OutlookConfig | None) -> dict[str, list[int]]:
    """Return the shape of each input of the network for one situation, in order."""
    more = {} if outlook is None else {"outlook": [outlook.size]}
    return {"state": STATE_SHAPE, **more}


def _evaluate(module: torch.nn.Module, *inputs: NDArray[np.float32]) -> NDArray[np.float32]:
    with torch.inference_mode():
        values: NDArray[np.float32] = module(*map(torch.from_numpy, inputs)).numpy()
        return values


def _read_outlook(path: Path | str, contract: Mapping[str, Any]) -> OutlookConfig | None:
    """Return what the network is told beyond the state, if this program can tell it that."""
    found = contract.get("outlook")
    if found is None:
        return None
    _require_equal(path, "outlook_layout", contract.get("outlook_layout"), OUTLOOK_LAYOUT)
    try:
        return OutlookConfig(**found)
    except (TypeError, ConfigurationError) as error:
        raise PolicyFileError(f"policy file {path}: outlook cannot be used: {error}") from error


def _read_contract(path: Path | str, text: str | bytes) -> dict[str, Any]:
    if not text:
        raise PolicyFileError(f"policy file {path} has no {CONTRACT}; save it with save_policy")
    try:
        contract = json.loads(text)
    except ValueError as error:
        raise PolicyFileError(f"policy file {path}: {CONTRACT} is not JSON: {error}") from error
    if not isinstance(contract, dict) or not isinstance(contract.get("name"), str):
        raise PolicyFileError(f"policy file {path}: {CONTRACT} has no name of the policy")
    return contract


def _require_equal(path: Path | str, name: str, value: object, expected: object) -> None:
    """Compare part by part, so that the sentence names the one number that differs."""
    if isinstance(expected, Mapping) and isinstance(value, Mapping):
        for key in sorted(expected.keys() | value.keys()):
            _require_equal(path, f"{name}.{key}", value.get(key), expected.get(key))
    elif value != expected:
        raise PolicyFileError(f"policy file {path}: {name} is {value}, expected {expected}")


def _check_golden(
    path: Path | str,
    module: torch.jit.ScriptModule,
    contract: Mapping[str, Any],
    outlook: OutlookConfig | None,
) -> None:
    shapes = _input_shapes(outlook)
    try:
        golden = contract["golden"]
        inputs = {name: np.asarray(golden[name], dtype=np.float32) for name in shapes}
        expected = np.asarray(golden["q_values"], dtype=np.float32)
    except (KeyError, TypeError, ValueError) as error:
        raise PolicyFileError(
            f"policy file {path}: {CONTRACT} has no golden {' and '.join(shapes)} with its q_values"
        ) from error
    for name, one in shapes.items():
        found = inputs[name].shape
        if len(found) != len(one) + 1 or list(found[1:]) != one:
            raise PolicyFileError(
                f"policy file {path}: the golden {name} has shape {found}, "
                f"expected (B, {', '.join(map(str, one))})"
            )
    try:
        values = np.asarray(_evaluate(module, *inputs.values()))
    except (RuntimeError, AttributeError, TypeError) as error:
        more = "" if outlook is None else f" with outlooks of shape {inputs['outlook'].shape}"
        raise PolicyFileError(
            f"policy file {path}: the network cannot take states of shape "
            f"{inputs['state'].shape}{more}"
        ) from error
    shape = (inputs["state"].shape[0], len(Action))
    if values.shape != shape:
        raise PolicyFileError(
            f"policy file {path}: the network returns shape {values.shape}, expected {shape}"
        )
    if expected.shape != shape or not np.allclose(
        values, expected, rtol=GOLDEN_TOLERANCE, atol=GOLDEN_TOLERANCE
    ):
        raise PolicyFileError(
            f"policy file {path}: the network returns {values.tolist()} for the golden state, "
            f"expected {expected.tolist()}"
        )
