# SPDX-License-Identifier: Apache-2.0
"""Variants of a training under the supervisor, each to see what one part of it is worth."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from risk_dqn_planner.policies.look_ahead import LookAheadConfig
from sim_bridge.learning.config import AdviceConfig
from sim_bridge.learning.presets import preset_named
from sim_bridge.learning.run import Run

Change = Callable[[Run], Run]


def _config(**changes: object) -> Change:
    return lambda run: replace(run, config=replace(run.config, **changes))  # type: ignore[arg-type]


def _advice(**changes: object) -> Change:
    def change(run: Run) -> Run:
        advice = replace(run.config.advice or AdviceConfig(), **changes)  # type: ignore[arg-type]
        return replace(run, config=replace(run.config, advice=advice))

    return change


def _rewards_alone(run: Run) -> Run:
    """Nobody shows the way, so it has to be explored: as much as the preset `supervised` does."""
    exploration = preset_named("supervised").exploration
    return replace(run, config=replace(run.config, advice=None, exploration=exploration))


def _state_alone(run: Run) -> Run:
    """The paper's state and no expert, as the preset `supervised` has it."""
    rewards = _rewards_alone(run)
    return replace(rewards, config=replace(rewards.config, outlook=False))


# Each differs from the first in one thing, but for those that leave out ever more of it.
VARIANTS: Mapping[str, Change] = {
    "reference": lambda run: run,
    "advice_alone": _advice(alone=True, weight_end=1.0),
    "advice_stays": _advice(weight_end=1.0),
    "advice_not_calm": _advice(switching_price_s=LookAheadConfig.switching_price_s),
    "rewards_alone": _rewards_alone,
    "state_alone": _state_alone,
    "with_memory": lambda run: replace(run, memory="tracked"),
    "reward_arrival": lambda run: replace(run, reward="arrival"),
    "reward_joint_risk": lambda run: replace(run, reward="joint_risk"),
    "one_step": _config(n_step=1),
    "one_update": _config(updates_per_step=1),
}
MEANING: Mapping[str, str] = {
    "reference": "Q-learning with an outlook and an expert's advice",
    "advice_alone": "no Q-learning: the expert is imitated",
    "advice_stays": "the advice's weight does not fall to 0 over the run",
    "advice_not_calm": "the expert pays no more for changes of action than when it drives itself",
    "rewards_alone": "no advice; more exploration instead",
    "state_alone": "no advice and no outlook: the paper's state",
    "with_memory": "trained and driven with the memory of free space (`tracked`)",
    "reward_arrival": "the reward has no prices for changes and hard brakes",
    "reward_joint_risk": "the reward counts the risk of all vehicles as well",
    "one_step": "one-step instead of five-step returns",
    "one_update": "one update a step of all environments instead of four",
}
