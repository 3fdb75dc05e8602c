# SPDX-License-Identifier: Apache-2.0
"""Several environments as one, so that one policy learns on several maps and scenarios at once."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.situation.situations import Booleans, Integers
from sim_bridge.environment.interface import Environment, EnvironmentStep, States


def shares_of(count: int, parts: int) -> list[int]:
    """Divide `count` environments or episodes among parts, as evenly as can be.

    Raises:
        ConfigurationError: there are fewer than one for each.
    """
    if count < parts:
        raise ConfigurationError(
            f"{count} environments or episodes for {parts} combinations of map and scenario, "
            "expected at least one for each"
        )
    return [count // parts + (k < count % parts) for k in range(parts)]


class SideBySide:
    """Environments in a row, each with its part of the batch; implements `Environment`."""

    def __init__(self, parts: Sequence[Environment]) -> None:
        """Put environments together.

        Raises:
            ConfigurationError: there is none, or they differ in the size of their states.
        """
        if len({part.features for part in parts}) != 1:
            raise ConfigurationError("expected environments with states of one size")
        self._parts = tuple(parts)
        self._ends = np.cumsum([part.batch for part in parts])[:-1]

    @property
    def batch(self) -> int:
        """The sum over the parts."""
        return sum(part.batch for part in self._parts)

    @property
    def features(self) -> int:
        """How many numbers a state has."""
        return self._parts[0].features

    @property
    def sound(self) -> Booleans:
        """Which actions (B, 3) may be taken now."""
        return np.concatenate([part.sound for part in self._parts])

    def advice(self) -> Integers:
        """Return what the parts' advisers would do now (B,)."""
        return np.concatenate([part.advice() for part in self._parts])

    def reset(self) -> States:
        """Begin the first episode of each environment; return the states (B, F)."""
        return np.concatenate([part.reset() for part in self._parts])

    def step(self, actions: NDArray[np.int64]) -> EnvironmentStep:
        """Take one action (B,) in each environment."""
        steps = [
            part.step(own)
            for part, own in zip(self._parts, np.split(actions, self._ends), strict=True)
        ]
        return EnvironmentStep._make(_joined(steps))

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically."""
        return {"parts": [part.state_dict() for part in self._parts]}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over an interrupted run of the same environments."""
        for part, own in zip(self._parts, state["parts"], strict=True):
            part.load_state_dict(own)


def _joined(steps: Sequence[EnvironmentStep]) -> Iterable[NDArray[Any]]:
    return (np.concatenate(column) for column in zip(*steps, strict=True))
