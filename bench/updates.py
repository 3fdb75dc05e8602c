# SPDX-License-Identifier: Apache-2.0
"""One update of the learner, compiled and written with torch: the same sums, to rounding."""

import copy

import numpy as np
import torch
from torch.nn.utils import parameters_to_vector, vector_to_parameters

from bench.options import Effort
from bench.report import Section
from bench.timing import in_turns, repeat_for
from risk_dqn_planner.policies.network import RiskDqn
from risk_dqn_planner.state.encoding import COLUMNS, ROWS, SCENES
from sim_bridge.learning.config import LearnerConfig
from sim_bridge.learning.export import initial_weights
from sim_bridge.learning.learner import Learner
from sim_bridge.learning.presets import preset_named
from sim_bridge.learning.replay import Sample, Transitions

NOTES = (
    (
        "One update: double Q target, weighted loss, gradient, Adam, soft target replacement, "
        "batch size and rates of the preset. torch runs on one thread; drawing from the replay"
        " is not in it."
    ),
)


def random_sample(batch: int) -> Sample:
    """Return transitions that are nothing in particular."""
    random = np.random.default_rng(0)
    size = (batch, SCENES * ROWS * COLUMNS)
    return Sample(
        indices=np.arange(batch),
        weights=random.uniform(0.5, 1.0, batch).astype(np.float32),
        transitions=Transitions(
            s_tm1=random.uniform(-1.0, 1.0, size).astype(np.float32),
            a_tm1=random.integers(0, 3, batch),
            r_t=random.uniform(-1.0, 1.0, batch).astype(np.float32),
            discount_t=np.full(batch, 0.99, dtype=np.float32),
            s_t=random.uniform(-1.0, 1.0, size).astype(np.float32),
            sound_t=np.ones((batch, 3), dtype=np.bool_),
        ),
    )


class TorchLearner:
    """The same update as `sim_bridge.learning.learner` makes."""

    def __init__(self, config: LearnerConfig, network: RiskDqn, sample: Sample) -> None:
        """Start from a network; all updates are of one sample."""
        self._config = config
        self.online = network
        self._target = copy.deepcopy(network).requires_grad_(requires_grad=False)
        self._adam = torch.optim.Adam(
            network.parameters(), lr=config.learning_rate, eps=config.adam_epsilon
        )
        shape = (-1, SCENES, ROWS, COLUMNS)
        moves = sample.transitions
        self._s_tm1 = torch.from_numpy(moves.s_tm1).reshape(shape)
        self._s_t = torch.from_numpy(moves.s_t).reshape(shape)
        self._a_tm1 = torch.from_numpy(moves.a_tm1)[:, None]
        self._r_t = torch.from_numpy(moves.r_t)
        self._discount_t = torch.from_numpy(moves.discount_t)
        self._weights = torch.from_numpy(sample.weights)

    def update(self) -> None:
        """Make one update."""
        with torch.no_grad():
            best = self.online(self._s_t).argmax(dim=1, keepdim=True)
            value = self._target(self._s_t).gather(1, best)[:, 0]
            y = self._r_t + self._discount_t * value
        error = y - self.online(self._s_tm1).gather(1, self._a_tm1)[:, 0]
        loss = (self._weights * error.square()).mean()
        self._adam.zero_grad()
        loss.backward()
        if self._config.max_gradient_norm is not None:
            torch.nn.utils.clip_grad_norm_(self.online.parameters(), self._config.max_gradient_norm)
        self._adam.step()
        with torch.no_grad():
            for old, new in zip(self._target.parameters(), self.online.parameters(), strict=True):
                old.lerp_(new, self._config.target_rate)


def compare(preset: str, effort: Effort) -> dict[str, float]:
    """Return microseconds an update of both, their ratio, and how far the weights differ."""
    config = preset_named(preset)
    weights, sample = initial_weights(0), random_sample(config.batch_size)
    ours = Learner(config.learner, weights)
    network = RiskDqn()
    vector_to_parameters(torch.from_numpy(weights.copy()), network.parameters())
    theirs = TorchLearner(config.learner, network, sample)
    for _ in range(3):
        ours.update(sample, 0.0)
        theirs.update()
    difference = np.abs(
        ours.weights - parameters_to_vector(theirs.online.parameters()).detach().numpy()
    ).max()
    turn_s = effort.updates * 1e-3
    rates = in_turns(
        {
            "ours": lambda: repeat_for(lambda: ours.update(sample, 0.0), turn_s),
            "torch": lambda: repeat_for(theirs.update, turn_s),
        },
        effort.rounds,
    )
    return {
        "batch": config.batch_size,
        "ours_us": 1e6 / rates["ours"],
        "torch_us": 1e6 / rates["torch"],
        "torch_over_ours": rates["ours"] / rates["torch"],
        "largest_difference_of_weights_after_3": float(difference),
    }


def measure(effort: Effort) -> Section:
    """Compare at the batch sizes of both presets."""
    torch.set_num_threads(1)
    return Section({name: compare(name, effort) for name in ("paper", "tuned")}, notes=NOTES)
