# SPDX-License-Identifier: Apache-2.0
"""The simulator as Gymnasium environments, one episode at a time or many side by side.

After `import sim_bridge.environment`:

    gymnasium.make("sim_bridge/OccludedIntersection-v0", map="four_way", scenario="base")
    gymnasium.make_vec("sim_bridge/OccludedIntersection-v0", num_envs=64, map="t_junction")

examples/train_stable_baselines3.py trains on it.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.batch import BatchEnvironment
from sim_bridge.environment.interface import EnvironmentStep, Outcome
from sim_bridge.environment.place import Places
from sim_bridge.environment.rewards import reward_named
from sim_bridge.environment.seeds import TRAINING_SEEDS
from sim_bridge.environment.snapshot import snapshot
from sim_bridge.rendering.render import frame_image
from sim_bridge.scenarios.loading import load_scenario


def _observation_space(environment: BatchEnvironment) -> spaces.Space[NDArray[np.float32]]:
    box: spaces.Space[Any] = spaces.Box(-1.0, 1.0, (environment.features,), np.float32)
    return box


def _build(map_name: str, scenario: str, reward: str, batch: int) -> BatchEnvironment:
    drawn = load_scenario(scenario)
    return BatchEnvironment(
        simulation=Places.named(map_name).of(drawn).simulation(drawn, batch),
        encoder=StateEncoder(),
        reward=reward_named(reward),
        risk=RiskConfig(),
        run_seed=0,
    )


def _ends(step: EnvironmentStep) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return (terminated, truncated) (B,)."""
    truncated = step.outcome == Outcome.TIMEOUT
    return (step.outcome != Outcome.RUNNING) & ~truncated, truncated


class OccludedIntersectionEnv(gymnasium.Env[NDArray[np.float32], np.int64]):
    """One episode at a time. Observations are the flattened states (5, 3, 8), see docs/paper.md.

    `reset(seed=k)` begins episode k of the scenario, the same as everywhere else in this
    project; `reset()` goes on with episodes of the training range that follow from it.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 2}  # noqa: RUF012

    def __init__(
        self,
        map: str = "four_way",  # noqa: A002 (the name users know)
        scenario: str = "base",
        reward: str = "risk",
        render_mode: str | None = None,
    ) -> None:
        """Lay out a scenario on a map by name or file, with a reward by name.

        Raises:
            PlannerError: one of them does not exist or cannot be used.
        """
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ConfigurationError(f"render_mode is {render_mode!r}, expected None or rgb_array")
        self.render_mode = render_mode
        self._batch = _build(map, scenario, reward, 1)
        self._action: Action | None = None
        self.observation_space = _observation_space(self._batch)
        self.action_space = spaces.Discrete(len(Action))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin episode `seed`, or the next one."""
        super().reset(seed=seed, options=options)
        self._action = None
        if seed is None:
            seed = int(self.np_random.integers(TRAINING_SEEDS.start, TRAINING_SEEDS.stop))
        return self._batch.reset(np.array([seed]))[0].copy(), {"episode_seed": seed}

    def step(
        self, action: np.int64
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Take one action for 0.5 s."""
        self._action = Action(int(action))
        step = self._batch.step(np.array([action], dtype=np.int64))
        terminated, truncated = _ends(step)
        ended = bool(terminated[0] or truncated[0])
        info = {"outcome": Outcome(int(step.outcome[0])).name.lower()} if ended else {}
        return (
            step.states[0].copy(),
            float(step.reward[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            info,
        )

    def render(self) -> NDArray[np.uint8] | None:
        """Return the view from above (480, 480, 3), if render_mode asks for it."""
        if self.render_mode is None:
            return None
        simulation = self._batch.simulation
        return frame_image(simulation.model, snapshot(simulation, 0, self._action))


class OccludedIntersectionVectorEnv(VectorEnv[NDArray[np.float32], NDArray[np.int64], Any]):
    """B episodes side by side in one call; an ended one begins anew with the next step."""

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": [],
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        map: str = "four_way",  # noqa: A002 (the name users know)
        scenario: str = "base",
        reward: str = "risk",
    ) -> None:
        """Lay out `num_envs` episodes; the rest as in OccludedIntersectionEnv."""
        self.num_envs = num_envs
        self._batch = _build(map, scenario, reward, num_envs)
        self.single_observation_space = _observation_space(self._batch)
        self.single_action_space = spaces.Discrete(len(Action))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin new episodes: `seed`, `seed` + 1, ..., or a list of them, or the next ones."""
        super().reset(seed=seed if isinstance(seed, int) else None, options=options)
        seeds = self.np_random.integers(
            TRAINING_SEEDS.start, TRAINING_SEEDS.stop, self.num_envs, dtype=np.int64
        )
        if isinstance(seed, int):
            seeds = seed + np.arange(self.num_envs)
        elif seed is not None:
            seeds = np.array([s if s is not None else d for s, d in zip(seed, seeds, strict=True)])
        return self._batch.reset(seeds).copy(), {"episode_seed": seeds}

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float64],
        NDArray[np.bool_],
        NDArray[np.bool_],
        dict[str, Any],
    ]:
        """Take one action in each environment; where an episode had ended, the next begins."""
        step = self._batch.step(np.asarray(actions, dtype=np.int64))
        terminated, truncated = _ends(step)
        reward = np.where(step.taken, step.reward, 0.0)
        return step.states.copy(), reward, terminated, truncated, {"outcome": step.outcome}
