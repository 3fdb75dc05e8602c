# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from risk_dqn_planner.policies.network import RiskDqn

pytestmark = pytest.mark.filterwarnings("ignore:.*torch.jit:DeprecationWarning")

Floats = NDArray[np.float64]


def make_network(seed: int = 0) -> RiskDqn:
    torch.manual_seed(seed)
    return RiskDqn().eval()


def some_states(batch: int = 4) -> torch.Tensor:
    return torch.rand(batch, 5, 3, 8, generator=torch.Generator().manual_seed(1)) * 2.0 - 1.0


def test_the_number_of_parameters_is_the_papers() -> None:
    features, hidden = 3 * (15 * 20 + 20), 160 * 120 + 120 + 120 * 120 + 120 + 120 * 3 + 3
    assert sum(p.numel() for p in make_network().parameters()) == features + hidden == 35163


def test_layers_have_the_papers_sizes() -> None:
    shapes = {name: tuple(p.shape) for name, p in make_network().named_parameters()}
    assert [shape for name, shape in shapes.items() if name.endswith("weight")] == [
        (20, 15),
        (20, 15),
        (20, 15),
        (120, 160),
        (120, 120),
        (3, 120),
    ]


def naive(network: RiskDqn, state: Floats) -> Floats:
    """The paper's figure column by column, for one state (5, 3, 8)."""
    weights = {n: p.detach().double().numpy() for n, p in network.named_parameters()}

    def layer(name: str, x: Floats) -> Floats:
        result: Floats = weights[f"{name}.weight"] @ x + weights[f"{name}.bias"]
        return result

    parts = ["h_ego", *["h_veh"] * 5, *["h_occ"] * 2]
    features = [
        np.maximum(layer(part, state[:, :, column].reshape(15)), 0.0)
        for column, part in enumerate(parts)
    ]
    hidden = np.maximum(layer("h_q.0", np.concatenate(features)), 0.0)
    return layer("h_q.4", np.maximum(layer("h_q.2", hidden), 0.0))


def test_it_computes_what_the_papers_figure_shows() -> None:
    network, states = make_network(), some_states()
    values = network(states).detach().numpy()
    for state, q_values in zip(states.double().numpy(), values, strict=True):
        np.testing.assert_allclose(q_values, naive(network, state), rtol=1e-4, atol=1e-6)


def test_vehicles_share_their_weights_and_so_do_lanes() -> None:
    network, states = make_network(), some_states()
    with torch.no_grad():
        # Give all vehicles the same say in h_Q, and both lanes: then their order is nothing.
        first = network.get_parameter("h_q.0.weight").view(120, 8, 20)
        first[:, 1:6] = first[:, 1:2].clone()
        first[:, 6:8] = first[:, 6:7].clone()
        mixed = states[..., [0, 4, 1, 5, 3, 2, 7, 6]]
        torch.testing.assert_close(network(mixed), network(states))
        assert not torch.allclose(network(states[..., [1, 0, *range(2, 8)]]), network(states))


def test_the_scripted_network_equals_the_eager_one() -> None:
    network = make_network()
    scripted = torch.jit.script(network)
    for batch in (1, 7):
        torch.testing.assert_close(scripted(some_states(batch)), network(some_states(batch)))
