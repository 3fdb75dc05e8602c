# SPDX-License-Identifier: Apache-2.0
"""The update of the paper's DQN: double Q-learning, Adam, soft target replacement."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.compiled import reordering_kernel
from risk_dqn_planner.errors import ConfigurationError
from sim_bridge.learning import compiled_network as network
from sim_bridge.learning.advice import Advice, advice_loss
from sim_bridge.learning.compiled_network import Signals, empty_signals, outlook_of
from sim_bridge.learning.config import LearnerConfig
from sim_bridge.learning.dense import Adam, Array, adam_step, mix, shorten
from sim_bridge.learning.losses import (
    double_q_target,
    rule_out,
    weighted_loss,
    weighted_loss_slope,
)
from sim_bridge.learning.replay import Sample, Transitions


class Weights(NamedTuple):
    """Flat weights (P,) of both networks, the optimiser's moments, memory for the gradient."""

    online: Array
    target: Array
    adam: Adam
    gradient: Array


class Workspace(NamedTuple):
    """Memory of an update of B transitions: signals of both networks, derivatives, TD errors."""

    now: Signals
    next_online: Signals
    next_target: Signals
    by: Signals
    errors: Array


class Rates(NamedTuple):
    """LearnerConfig as the numbers that kernels read, at one point of the run."""

    learning_rate: float
    adam_epsilon: float
    target_rate: float
    max_gradient_norm: float


@reordering_kernel
def _update(
    weights: Weights, rates: Rates, batch: Transitions, importance: Array, work: Workspace
) -> float:
    """Make one update from B transitions; fill `work.errors` (B,) and return the loss."""
    network.values(weights.online, batch.s_t, work.next_online)
    network.values(weights.target, batch.s_t, work.next_target)
    network.values(weights.online, batch.s_tm1, work.now)
    loss = 0.0
    count = batch.r_t.shape[0]
    work.by.q[:] = 0.0
    for k in range(count):
        rule_out(work.next_online.q[k], batch.sound_t[k])
        y = double_q_target(
            batch.r_t[k], batch.discount_t[k], work.next_online.q[k], work.next_target.q[k]
        )
        action = batch.a_tm1[k]
        error = y - work.now.q[k, action]
        work.errors[k] = error
        work.by.q[k, action] = weighted_loss_slope(error, importance[k], count)
        loss += weighted_loss(error, importance[k], count)
    network.gradient(weights.online, work.now, work.by, weights.gradient)
    if rates.max_gradient_norm < math.inf:
        shorten(weights.gradient, rates.max_gradient_norm)
    adam_step(
        weights.online, weights.gradient, weights.adam, rates.learning_rate, rates.adam_epsilon
    )
    mix(weights.target, weights.online, rates.target_rate)
    return loss


@reordering_kernel
def _follow(
    weights: Weights,
    rates: Rates,
    advice: Advice,
    weight: float,
    temperature: float,
    now: Signals,
    by: Signals,
) -> float:
    """Make one step towards advice (K,), and return the loss before it."""
    network.values(weights.online, advice.states, now)
    loss = advice_loss(now.q, advice.sound, advice.action, temperature, by.q)
    by.q[:] = by.q * np.float32(weight)
    network.gradient(weights.online, now, by, weights.gradient)
    if rates.max_gradient_norm < math.inf:
        shorten(weights.gradient, rates.max_gradient_norm)
    adam_step(
        weights.online, weights.gradient, weights.adam, rates.learning_rate, rates.adam_epsilon
    )
    return loss


class Learner:
    """Online and target network with the optimiser of the online one."""

    def __init__(self, config: LearnerConfig, weights: Array) -> None:
        """Start both networks from flat weights (P,), in the order of the torch module."""
        self._config = config
        self._weights = Weights(
            online=weights.copy(),
            target=weights.copy(),
            adam=Adam(np.zeros_like(weights), np.zeros_like(weights), np.zeros(1, np.int64)),
            gradient=np.zeros_like(weights),
        )
        self._outlook = outlook_of(len(weights))
        self._work = _workspace(0, self._outlook)
        self._signals = empty_signals(0, self._outlook)
        self._of_advice = (empty_signals(0, self._outlook), empty_signals(0, self._outlook))

    @property
    def weights(self) -> Array:
        """The online network's flat weights (P,); they change with every update."""
        return self._weights.online

    def q_values(self, states: Array) -> Array:
        """Return Q-values (B, 3) of the online network for flat states (B, F), reused memory.

        Raises:
            ConfigurationError: the network takes states of another size.
        """
        if states.shape[1] != network.FEATURES + self._outlook:
            raise ConfigurationError(
                f"states have {states.shape[1]} numbers, "
                f"expected {network.FEATURES + self._outlook}"
            )
        if self._signals.q.shape[0] != states.shape[0]:
            self._signals = empty_signals(states.shape[0], self._outlook)
        network.values(self._weights.online, states, self._signals)
        return self._signals.q

    def update(self, sample: Sample, progress: float) -> tuple[Array, float]:
        """Make one update from a draw; return its TD errors (B,), reused memory, and its loss.

        `progress` is the share of the run that is over, for the learning rate.
        """
        if self._work.errors.shape != sample.weights.shape:
            self._work = _workspace(sample.weights.shape[0], self._outlook)
        rates = self._rates(progress)
        loss = _update(self._weights, rates, sample.transitions, sample.weights, self._work)
        return self._work.errors, loss

    def follow(self, advice: Advice, weight: float, temperature: float, progress: float) -> float:
        """Make one step towards an expert's actions; return the loss, as in `advice_loss`."""
        count = len(advice.action)
        if self._of_advice[0].q.shape[0] != count:
            now, by = empty_signals(count, self._outlook), empty_signals(count, self._outlook)
            self._of_advice = (now, by)
        rates = self._rates(progress)
        loss: float = _follow(self._weights, rates, advice, weight, temperature, *self._of_advice)
        return loss

    def _rates(self, progress: float) -> Rates:
        config = self._config
        return Rates(
            learning_rate=config.rate(progress),
            adam_epsilon=config.adam_epsilon,
            target_rate=config.target_rate,
            max_gradient_norm=config.max_gradient_norm or math.inf,
        )

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically."""
        return {name: array.copy() for name, array in self._arrays().items()}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over the weights and the optimiser of an interrupted run."""
        for name, array in self._arrays().items():
            array[:] = state[name]

    def _arrays(self) -> dict[str, NDArray[Any]]:
        weights = self._weights
        return {
            "online": weights.online,
            "target": weights.target,
            "adam_mean": weights.adam.mean,
            "adam_square": weights.adam.square,
            "adam_steps": weights.adam.steps,
        }


def _workspace(batch: int, outlook: int) -> Workspace:
    return Workspace(
        now=empty_signals(batch, outlook),
        next_online=empty_signals(batch, outlook),
        next_target=empty_signals(batch, outlook),
        by=empty_signals(batch, outlook),
        errors=np.zeros(batch, dtype=np.float32),
    )
