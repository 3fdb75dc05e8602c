# SPDX-License-Identifier: Apache-2.0
"""Where a policy comes from, as its file's contract tells."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.policy_file import load_policy_file
from sim_bridge.learning.presets import PRESETS

# What `train` takes where it is not told otherwise.
_DEFAULTS = {
    "map_name": "four_way",
    "scenario": "base",
    "supervisor": "off",
    "memory": "instantaneous",
}


@dataclass(frozen=True)
class Origin:
    """The training run of a policy file.

    name: given in training. run: its description as JSON. validation: how the best policy did on
    the validation episodes that chose it, after `best_steps` environment steps.
    """

    name: str
    sha256: str
    run: Mapping[str, Any]
    best_steps: int
    validation: Mapping[str, Any]
    maps: tuple[str, ...]
    git_revision: str
    versions: Mapping[str, str]

    @property
    def preset(self) -> str:
        """Name of the preset it was trained with."""
        return str(self.run["config"]["preset"])

    @property
    def reward(self) -> str:
        """Name of the reward it was trained with."""
        return str(self.run["reward"])

    @property
    def seed(self) -> int:
        """Seed of the training run."""
        return int(self.run["seed"])

    @property
    def scenarios(self) -> tuple[str, ...]:
        """Names of the scenarios it was trained in."""
        return tuple(str(self.run["scenario"]).split(","))

    @property
    def steps(self) -> int:
        """Environment steps of the whole run."""
        return int(self.run["config"]["steps"])

    @property
    def company(self) -> list[tuple[str, str]]:
        """What it learned under, by name: an enforcing supervisor, a memory, an expert."""
        found = [
            (name, str(self.run[name])) for name in ("supervisor", "memory") if name in self.run
        ]
        if self.looks:
            found.append(("outlook", "what is sound, where to wait, margins of going later"))
        if "advice" in self.run["config"]:
            found.append(("advice", "of the look-ahead search"))
        return found

    @property
    def looks(self) -> bool:
        """Whether its network is told more than the paper's state."""
        return bool(self.run["config"].get("outlook", False))

    @property
    def default_name(self) -> str:
        """The name that training gives when it is not told another."""
        return f"{self.reward}_{self.preset}"

    def folder(self) -> str:
        """Return where `command` puts its results."""
        return f"out/training/{self.name}_seed{self.seed}"

    def command(self) -> str:
        """Return what trains this policy, to be run at its revision."""
        words = [f"PRESET={self.preset}", f"REWARD={self.reward}", f"SEED={self.seed}"]
        preset = PRESETS.get(self.preset)
        if preset is None or preset.steps != self.steps:
            words.append(f"STEPS={self.steps}")
        for key, default in _DEFAULTS.items():
            value = str(self.run.get(key, default))
            if value != default:
                words.append(f"{key.removesuffix('_name').upper()}={shlex.quote(value)}")
        if self.name != self.default_name:
            words.append(f"NAME={shlex.quote(self.name)}")
        return f"make train {' '.join(words)}"


def origin_of(path: Path) -> Origin:
    """Read where a policy file comes from.

    Raises:
        PolicyFileError: the file cannot be used.
        ConfigurationError: `train` has not written it.
    """
    file = load_policy_file(path)
    training = file.contract.get("training", {})
    try:
        return Origin(
            name=file.name,
            sha256=file.sha256,
            run=training["run"],
            best_steps=training["best_steps"],
            validation=training["validation"],
            maps=tuple(file.contract["maps"]),
            git_revision=str(file.contract["git_revision"]),
            versions=training.get("versions", {}),
        )
    except (KeyError, TypeError) as error:
        raise ConfigurationError(
            f"{path} does not tell how it was trained ({error} is missing), expected a policy "
            "that `train` has written"
        ) from error
