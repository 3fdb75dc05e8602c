# SPDX-License-Identifier: Apache-2.0
"""Training of the paper's DQN: replay, learner, loop, checkpoints (double DQN, prioritised)."""
