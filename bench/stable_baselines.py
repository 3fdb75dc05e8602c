# SPDX-License-Identifier: Apache-2.0
"""stable-baselines3's DQN on this project's Gymnasium environment."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import torch
from stable_baselines3 import DQN
from stable_baselines3.common.env_checker import check_env
from stable_baselines3.common.env_util import make_vec_env

from bench.progress import say
from bench.success import EPISODES, Reached
from bench.timing import Stopwatch
from risk_dqn_planner.policies.base import Decisions, Reason, bare_decisions
from risk_dqn_planner.situation.situations import Booleans, Situations
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.episodes import drive
from sim_bridge.environment.gym import OccludedIntersectionEnv
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.place import Place
from sim_bridge.environment.seeds import VALIDATION_SEEDS, fixed_seeds
from sim_bridge.scenarios.loading import load_scenario

SCENARIO, REWARD = "base", "risk"
LOOK_EVERY_STEPS = 5_000
HIDDEN = [120, 120]


@dataclass(frozen=True)
class Setup:
    """How the peer is used: environments side by side, steps, and arguments of its DQN.

    steps: of the whole run, which the schedule of exploration refers to.
    """

    environments: int
    steps: int
    arguments: Mapping[str, Any] = field(default_factory=dict)


COMMON = MappingProxyType(
    {
        "n_steps": 5,
        "buffer_size": 100_000,
        "learning_starts": 5_000,
        "gamma": 0.99,
        "tau": 0.01,
        "exploration_fraction": 0.3,
        "exploration_final_eps": 0.02,
        "gradient_steps": 1,
        "policy_kwargs": {"net_arch": HIDDEN},
        "device": "cpu",
    }
)
# The first is what one would tune by hand, the second has the numbers of our preset `tuned`. Both
# sum rewards over five steps: over one, the default, it still stood at the line after a minute.
SETUPS = {
    "one_environment": Setup(
        1,
        300_000,
        {
            **COMMON,
            "learning_rate": 5e-4,
            "batch_size": 64,
            "train_freq": 8,
            "target_update_interval": 8,
        },
    ),
    "64_environments": Setup(
        64,
        500_000,
        {
            **COMMON,
            "learning_rate": 1e-3,
            "batch_size": 256,
            "train_freq": 1,
            "target_update_interval": 64,
        },
    ),
}


class PeerPolicy:
    """The peer's network as a policy of ours, to be driven through the validation episodes."""

    name = "stable_baselines3"
    hash = ""

    def __init__(self, network: torch.nn.Module) -> None:
        self._network = network
        self._encoder = StateEncoder()

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Take the action of the highest Q-value."""
        states = self._encoder.encode(situations, restart)
        with torch.inference_mode():
            flat = torch.from_numpy(states.reshape(len(states), -1))
            q_values = self._network(flat).numpy().astype(np.float64)
        return bare_decisions(q_values.argmax(axis=1), Reason.LEARNED, q_values)


def train(setup: Setup, place: Place, limit_s: float) -> Reached:
    """Train until the highest level is reached or the processor time is over.

    The environment passes the peer's own check first. Validating is not counted.
    """
    torch.set_num_threads(1)
    check_env(OccludedIntersectionEnv(place.map_name, SCENARIO, REWARD))
    environment = make_vec_env(
        OccludedIntersectionEnv,
        n_envs=setup.environments,
        seed=0,
        env_kwargs={"map": place.map_name, "scenario": SCENARIO, "reward": REWARD},
    )
    model = DQN("MlpPolicy", environment, seed=0, **setup.arguments)
    validation = place.simulation(load_scenario(SCENARIO), EPISODES)
    seeds = fixed_seeds(VALIDATION_SEEDS, EPISODES)
    reached, watch = Reached(), Stopwatch()
    looked = 0

    def look(_locals: dict[str, Any], _globals: dict[str, Any]) -> bool:
        """Validate now and then; return whether to go on."""
        nonlocal looked
        if model.num_timesteps - looked < LOOK_EVERY_STEPS:
            return watch.cpu_s <= limit_s
        looked = model.num_timesteps
        with watch.stopped():
            success = drive(validation, PeerPolicy(model.q_net), seeds).share(Outcome.SUCCESS)
        reached.look(success, watch.cpu_s, watch.wall_s, looked)
        say(f"  {looked} steps, {watch.cpu_s:.0f} s: success {success:.1%}")
        return not reached.done and watch.cpu_s <= limit_s

    model.learn(setup.steps, callback=look)
    environment.close()
    if not reached.done:
        reached.cpu_s = watch.cpu_s
    return reached
