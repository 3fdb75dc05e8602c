# SPDX-License-Identifier: Apache-2.0
"""What the shipped policies are for, and how each must have been trained."""

from dataclasses import dataclass

from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.learning.origin import Origin


@dataclass(frozen=True)
class Role:
    """A name among the shipped policies. preset, reward: what it stands for, None for any."""

    purpose: str
    preset: str | None = None
    reward: str | None = None

    def check(self, name: str, origin: Origin) -> None:
        """Refuse a policy that is not what the name promises.

        Raises:
            ConfigurationError: another preset or reward.
        """
        for what, value, expected in (
            ("preset", origin.preset, self.preset),
            ("reward", origin.reward, self.reward),
        ):
            if expected is not None and value != expected:
                raise ConfigurationError(
                    f"{name} stands for the {what} '{expected}', "
                    f"but this policy was trained with '{value}'"
                )


ROLES = {
    "risk_aware_paper": Role(
        purpose="The paper's risk-aware DQN, trained with the paper's own numbers (Table I) on "
        "its own reward. It is here to be compared with: whoever repeats the paper finds its "
        "subject ready to run.",
        preset="paper",
        reward="risk",
    ),
    "collision_aware_paper": Role(
        purpose="The paper's learned baseline: network and training are those of the risk-aware "
        "DQN, but only collisions and success are rewarded. It is here to be compared with, not "
        "to be driven with.",
        preset="paper",
        reward="collision",
    ),
    "tuned": Role(
        purpose="The paper's network and state, trained with more episodes side by side, larger "
        "batches and a higher learning rate than the paper's. It decides without a supervisor, "
        "and then it can collide.",
    ),
    "sound_dqn": Role(
        purpose="The planner's default. Its supervisor is part of it, in training and on the "
        "vehicle: it takes sound actions only (docs/safety.md), and its network is told which "
        "these are, where the ego can wait, and how much time there would be if it waited and "
        "then went. It learned by Q-learning with the advice of the look-ahead search, and "
        "searches nothing itself.",
        preset="advised",
    ),
}


def role_named(name: str) -> Role:
    """Return what a shipped name stands for.

    Raises:
        ConfigurationError: no policy is shipped under that name.
    """
    if name not in ROLES:
        raise ConfigurationError(
            f"no policy is shipped as '{name}', expected one of: {', '.join(ROLES)}"
        )
    return ROLES[name]
