# SPDX-License-Identifier: Apache-2.0
"""Training presets: the paper's own numbers, and three of ours.

`tuned` gets to the same success sooner; `supervised` is for training under the supervisor, and
`advised` for that with an outlook and an expert.
`paper` is the paper's Table I and its text to the letter. What the paper leaves open:
optimiser (Adam), exploration, exponents of the prioritised replay, when learning starts; these
are the defaults of config.py.
"""

from dataclasses import replace

from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.learning.config import (
    AdviceConfig,
    EvaluationConfig,
    ExplorationConfig,
    LearnerConfig,
    ReplayConfig,
    TrainingConfig,
)

_TUNED = TrainingConfig(
    preset="tuned",
    steps=500_000,
    environments=64,
    updates_per_step=1,
    batch_size=256,
    warmup_steps=5_000,
    gamma=0.99,
    n_step=5,
    replay=ReplayConfig(capacity=100_000),
    exploration=ExplorationConfig(start=1.0, end=0.02, share=0.3),
    learner=LearnerConfig(
        learning_rate=1e-3,
        learning_rate_end=1e-4,
        target_rate=0.01,
        max_gradient_norm=10.0,
    ),
    evaluation=EvaluationConfig(
        every_episodes=1_000, episodes=20, validation_every=2, validation_episodes=2_000
    ),
)
# Under the supervisor collisions are out of the question, so there is time to try things.
_SUPERVISED = replace(
    _TUNED,
    preset="supervised",
    steps=1_500_000,
    updates_per_step=2,
    replay=ReplayConfig(capacity=200_000),
    exploration=ExplorationConfig(start=1.0, end=0.02, share=0.4, repeat=0.8),
    learner=replace(_TUNED.learner, learning_rate_end=3e-5),
    evaluation=EvaluationConfig(
        every_episodes=2_000, episodes=20, validation_every=3, validation_episodes=2_000
    ),
)
# The expert knows the way: little is left to be explored.
_ADVISED = replace(
    _SUPERVISED,
    preset="advised",
    environments=128,
    updates_per_step=4,
    exploration=ExplorationConfig(start=0.05, end=0.01, share=0.5),
    evaluation=EvaluationConfig(
        every_episodes=4_000, episodes=20, validation_every=2, validation_episodes=2_000
    ),
    outlook=True,
    advice=AdviceConfig(),
)

PRESETS = {
    "paper": TrainingConfig(
        preset="paper",
        steps=400_000,
        environments=1,
        updates_per_step=1,
        batch_size=16,
        gamma=0.99,
        n_step=1,
        replay=ReplayConfig(capacity=50_000),
        learner=LearnerConfig(learning_rate=1e-5, learning_rate_end=1e-5, target_rate=0.2),
        evaluation=EvaluationConfig(every_episodes=50, episodes=20, validation_episodes=2_000),
    ),
    "tuned": _TUNED,
    "supervised": _SUPERVISED,
    "advised": _ADVISED,
}


def preset_named(name: str) -> TrainingConfig:
    """Return a preset by its name.

    Raises:
        ConfigurationError: there is none of that name.
    """
    if name not in PRESETS:
        raise ConfigurationError(
            f"there is no preset '{name}', expected one of: {', '.join(sorted(PRESETS))}"
        )
    return PRESETS[name]
