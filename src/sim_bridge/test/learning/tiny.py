# SPDX-License-Identifier: Apache-2.0
"""The smallest training that does everything a long one does."""

from sim_bridge.learning.config import EvaluationConfig, LearnerConfig, ReplayConfig, TrainingConfig

TINY = TrainingConfig(
    preset="tiny",
    steps=600,
    environments=4,
    batch_size=8,
    warmup_steps=50,
    n_step=2,
    replay=ReplayConfig(capacity=300),
    learner=LearnerConfig(learning_rate=1e-3),
    evaluation=EvaluationConfig(
        every_episodes=4, episodes=4, validation_every=2, validation_episodes=5
    ),
)
