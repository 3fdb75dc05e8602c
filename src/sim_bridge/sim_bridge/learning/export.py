# SPDX-License-Identifier: Apache-2.0
"""Between flat weights and the torch module that is initialised, exported and shipped."""

import numpy as np
import torch
from torch.nn.utils import parameters_to_vector, vector_to_parameters

from risk_dqn_planner.policies.network import OutlookDqn, RiskDqn
from sim_bridge.learning.compiled_network import outlook_of
from sim_bridge.learning.dense import Array


def initial_weights(seed: int, outlook: int = 0) -> Array:
    """Return the weights (P,) of a new network, drawn as torch draws them.

    outlook: how many numbers it is told beyond the paper's state.
    """
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        network = OutlookDqn(outlook) if outlook else RiskDqn()
    weights: Array = parameters_to_vector(network.parameters()).detach().numpy()
    return weights


def network_of(weights: Array) -> RiskDqn | OutlookDqn:
    """Return a torch network with these weights (P,)."""
    outlook = outlook_of(len(weights))
    network = OutlookDqn(outlook) if outlook else RiskDqn()
    copied = torch.from_numpy(np.array(weights))
    vector_to_parameters(copied, network.parameters())
    return network
