# SPDX-License-Identifier: Apache-2.0
"""Train stable-baselines3's DQN at an occluded intersection, then count how it drives.

In this project's environment (`make shell`):

    python tools/peers.py -- python examples/train_stable_baselines3.py

or in your own, without ROS:

    pip install -r requirements/python.txt stable-baselines3
    export PYTHONPATH=src/risk_dqn_planner:src/sim_bridge
    python examples/train_stable_baselines3.py

The environment's observation is the paper's state, flattened: five moments of the ego, of five
vehicles and of two occluded lanes. Its actions are Stop, Slow and Fast, each for half a second.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence

import gymnasium
from stable_baselines3 import DQN

import sim_bridge.environment  # noqa: F401 (makes the environment known to Gymnasium)

ENVIRONMENT = "sim_bridge/OccludedIntersection-v0"


def train(options: argparse.Namespace) -> DQN:
    """Train on episodes that are drawn anew each time."""
    environment = gymnasium.make(
        ENVIRONMENT, map=options.map, scenario=options.scenario, reward=options.reward
    )
    model = DQN(
        "MlpPolicy",
        environment,
        # What matters most: rewards summed over five steps, else it learns to stand still.
        n_steps=5,
        learning_rate=5e-4,
        batch_size=64,
        buffer_size=100_000,
        learning_starts=min(5_000, options.steps // 4),
        train_freq=8,
        tau=0.01,
        target_update_interval=8,
        exploration_fraction=0.5,
        exploration_final_eps=0.02,
        policy_kwargs={"net_arch": [120, 120]},
        device="cpu",
        seed=options.seed,
        verbose=1,
    )
    return model.learn(options.steps, log_interval=200)


def evaluate(model: DQN, options: argparse.Namespace) -> Counter[str]:
    """Drive test episodes without exploring; return how often each outcome came.

    The seed of a reset names the episode: 0, 1, 2 ... are the same for everyone and in no training.
    """
    environment = gymnasium.make(ENVIRONMENT, map=options.map, scenario=options.scenario)
    outcomes: Counter[str] = Counter()
    for seed in range(options.episodes):
        state, _ = environment.reset(seed=seed)
        ended = False
        while not ended:
            action, _ = model.predict(state, deterministic=True)
            state, _, terminated, truncated, info = environment.step(action)
            ended = terminated or truncated
        outcomes[info["outcome"]] += 1
    return outcomes


def main(arguments: Sequence[str] | None = None) -> int:
    """Train and evaluate as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--map", default="four_way", help="own map or .osm file [%(default)s]")
    parser.add_argument("--scenario", default="base", help="name or .yaml file [%(default)s]")
    parser.add_argument("--reward", default="risk", help="name of a reward [%(default)s]")
    parser.add_argument("--steps", type=int, default=150_000, help="of training [%(default)s]")
    parser.add_argument("--episodes", type=int, default=500, help="of the test [%(default)s]")
    parser.add_argument("--seed", type=int, default=0, help="of the training [%(default)s]")
    parser.add_argument("--save", metavar="FILE", help="keep the model, a .zip")
    options = parser.parse_args(arguments)
    model = train(options)
    if options.save:
        model.save(options.save)
    outcomes = evaluate(model, options)
    for outcome in ("success", "collision", "timeout"):
        print(f"{outcome:<10}{outcomes[outcome] / options.episodes:7.1%}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
