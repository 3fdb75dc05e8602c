# SPDX-License-Identifier: Apache-2.0
"""Between flat weights and the torch module that is initialised, exported and shipped."""

import numpy as np
import torch
from torch.nn.utils import parameters_to_vector, vector_to_parameters

from risk_dqn_planner.policies.network import RiskDqn
from sim_bridge.learning.dense import Array


def initial_weights(seed: int) -> Array:
    """Return the weights (P,) of a new network, drawn as torch draws them."""
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        network = RiskDqn()
    weights: Array = parameters_to_vector(network.parameters()).detach().numpy()
    return weights


def network_of(weights: Array) -> RiskDqn:
    """Return a torch network with these weights (P,)."""
    network = RiskDqn()
    copied = torch.from_numpy(np.array(weights))
    vector_to_parameters(copied, network.parameters())
    return network
