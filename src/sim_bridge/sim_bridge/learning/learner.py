# SPDX-License-Identifier: Apache-2.0
"""The update of the paper's DQN: double Q-learning, Adam, soft target replacement.

A batch of 16 is so small that the cost is in the number of tensor operations. All weights of a
network therefore lie in one flat tensor, so that Adam and the target's step are one each.
"""

import copy
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from sim_bridge.learning.config import LearnerConfig
from sim_bridge.learning.losses import (
    double_q_targets,
    td_errors,
    weighted_loss,
    weighted_loss_gradient,
)
from sim_bridge.learning.replay import Sample

Floats = NDArray[np.float32]


def flatten_parameters(network: nn.Module) -> nn.Parameter:
    """Move all weights of a network, and their gradients, into one flat tensor and return it.

    The network's own parameters become views, so either side sees what the other writes.
    """
    parameters = list(network.parameters())
    flat = nn.Parameter(torch.cat([p.detach().reshape(-1) for p in parameters]))
    flat.grad = torch.zeros_like(flat)
    start = 0
    for parameter in parameters:
        end = start + parameter.numel()
        parameter.data = flat.data[start:end].view_as(parameter)
        parameter.grad = flat.grad[start:end].view_as(parameter)
        start = end
    return flat


class Learner:
    """Online and target network with the optimiser of the online one."""

    def __init__(self, config: LearnerConfig, online: nn.Module, target: nn.Module) -> None:
        """Take two networks of the same structure; the target starts with the online weights."""
        target.load_state_dict(online.state_dict())
        self._config = config
        self._online = online
        self._target = target
        self._weights = flatten_parameters(online)
        self._target_weights = flatten_parameters(target).requires_grad_(False)
        self._optimizer = torch.optim.Adam(
            [self._weights], lr=config.learning_rate, eps=config.adam_epsilon, fused=True
        )

    @property
    def network(self) -> nn.Module:
        """The online network, to act with and to export."""
        return self._online

    def q_values(self, states: Floats) -> Floats:
        """Return Q-values (B, A) of the online network for states (B, ...)."""
        with torch.inference_mode():
            return cast(Floats, self._online(torch.from_numpy(states)).numpy())

    def update(self, sample: Sample, progress: float) -> tuple[Floats, float]:
        """Make one update from a draw; return its TD errors (B,) and its loss.

        `progress` is the share of the run that is over, for the learning rate.
        """
        s_tm1, a_tm1, r_t, discount_t, s_t = sample.transitions
        with torch.inference_mode():
            next_states = torch.from_numpy(s_t)
            q_t_online = self._online(next_states).numpy()
            q_t_target = self._target(next_states).numpy()
        q_tm1 = self._online(torch.from_numpy(s_tm1))
        targets = double_q_targets(r_t, discount_t, q_t_online, q_t_target)
        errors = td_errors(q_tm1.detach().numpy(), a_tm1, targets)
        gradient = weighted_loss_gradient(errors, sample.weights, a_tm1, q_tm1.shape[1])
        self._descend(q_tm1, torch.from_numpy(gradient), progress)
        return errors, weighted_loss(errors, sample.weights)

    def _descend(self, q_tm1: torch.Tensor, gradient: torch.Tensor, progress: float) -> None:
        flat_gradient = cast(torch.Tensor, self._weights.grad)
        flat_gradient.zero_()
        torch.autograd.backward((q_tm1,), (gradient,))
        if np.isfinite(self._config.max_gradient_norm):
            norm = float(flat_gradient.norm())
            flat_gradient.mul_(min(1.0, self._config.max_gradient_norm / (norm + 1e-12)))
        self._optimizer.param_groups[0]["lr"] = self._config.rate(progress)
        self._optimizer.step()
        self._target_weights.data.lerp_(self._weights.data, self._config.target_rate)

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically."""
        return {
            "online": self._weights.detach().clone(),
            "target": self._target_weights.detach().clone(),
            "optimizer": copy.deepcopy(self._optimizer.state_dict()),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over the weights and the optimiser of an interrupted run."""
        self._weights.data.copy_(state["online"])
        self._target_weights.data.copy_(state["target"])
        self._optimizer.load_state_dict(state["optimizer"])
