# SPDX-License-Identifier: Apache-2.0
"""Rewards by name: the paper's two, one that counts hidden vehicles too, and two for smoothness.

All are weighted sums of the same terms, so a further one is a line in REWARDS.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.risk.risk import RiskConfig, assess
from risk_dqn_planner.situation.situations import Booleans, Situations

Rewards = NDArray[np.float32]


@dataclass(frozen=True)
class RewardConfig:
    """R = risk_weight R_risk + utility_weight v / v_max, plus what events are worth.

    include_hidden: whether virtual vehicles of occluded lanes count in R_risk.
    collision, goal: added to the step in which it happens; step: added to every other one.
    switch: added where the action is not the one before; hard_brake: added to a step that takes
    more than 1 m/s off the ego's speed. Both as the statistics of an episode count them.
    """

    risk_weight: float = 0.0
    utility_weight: float = 0.0
    include_hidden: bool = False
    collision: float = 0.0
    goal: float = 0.0
    step: float = 0.0
    switch: float = 0.0
    hard_brake: float = 0.0

    @property
    def prices_manners(self) -> bool:
        """Whether it matters how an action follows the one before."""
        return self.switch != 0.0 or self.hard_brake != 0.0


# Paper: Table I for the weights; section "RL with collision-aware reward" for the events (it
# names -200 and +100 elsewhere, as an example of earlier work). Ours, `arrival`, `progress` and
# `joint_risk`, are for training under the supervisor: where nothing sound collides, what is left to
# learn is to arrive soon and smoothly.
REWARDS = {
    "risk": RewardConfig(risk_weight=0.8, utility_weight=0.2),
    "risk_with_occlusions": RewardConfig(risk_weight=0.8, utility_weight=0.2, include_hidden=True),
    "collision": RewardConfig(collision=-2.0, goal=1.0, step=-0.00001),
    "arrival": RewardConfig(collision=-2.0, goal=1.0, step=-0.01),
    "progress": RewardConfig(collision=-2.0, goal=1.0, step=-0.01, switch=-0.05, hard_brake=-0.03),
    "joint_risk": RewardConfig(
        risk_weight=0.02,
        include_hidden=True,
        collision=-2.0,
        goal=1.0,
        step=-0.01,
        switch=-0.05,
        hard_brake=-0.03,
    ),
}


def reward_named(name: str) -> RewardConfig:
    """Return a reward by its name.

    Raises:
        ConfigurationError: there is none of that name.
    """
    if name not in REWARDS:
        raise ConfigurationError(
            f"there is no reward '{name}', expected one of: {', '.join(sorted(REWARDS))}"
        )
    return REWARDS[name]


def rewards(
    config: RewardConfig,
    risk: RiskConfig,
    situations: Situations,
    collided: Booleans,
    at_goal: Booleans,
    switched: Booleans | None = None,
    hard_braked: Booleans | None = None,
) -> Rewards:
    """Return the reward (B,) of the steps that led to these situations.

    situations: as perceived after the step; collided, at_goal (B,): how the step ended;
    switched, hard_braked (B,): how it was driven, nowhere so if not given.
    """
    total = np.where(collided, config.collision, np.where(at_goal, config.goal, config.step))
    if config.risk_weight != 0.0:
        total += config.risk_weight * assess(situations, risk, config.include_hidden).total
    if config.utility_weight != 0.0:
        total += config.utility_weight * situations.ego_speed_mps / risk.ego.fast_mps
    if switched is not None:
        total += config.switch * switched
    if hard_braked is not None:
        total += config.hard_brake * hard_braked
    return cast(Rewards, total.astype(np.float32))
