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


def test_every_layer_has_the_papers_shape_and_there_is_no_other() -> None:
    shapes = {name: tuple(p.shape) for name, p in make_network().named_parameters()}
    assert shapes == {
        "h_ego.weight": (20, 15),
        "h_ego.bias": (20,),
        "h_veh.weight": (20, 15),
        "h_veh.bias": (20,),
        "h_occ.weight": (20, 15),
        "h_occ.bias": (20,),
        "h_q.0.weight": (120, 160),
        "h_q.0.bias": (120,),
        "h_q.2.weight": (120, 120),
        "h_q.2.bias": (120,),
        "h_q.4.weight": (3, 120),
        "h_q.4.bias": (3,),
    }


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


def embeddings(network: RiskDqn, states: torch.Tensor) -> torch.Tensor:
    """What h_Q is fed with, shape (B, 8, 20): 20 features for each column of the scenes."""
    fed: list[torch.Tensor] = []
    hook = network.h_q.register_forward_pre_hook(lambda _, given: fed.append(given[0]))
    with torch.no_grad():
        network(states)
    hook.remove()
    return fed[0].unflatten(1, (8, 20))


def test_permuting_vehicles_permutes_their_embeddings_and_so_it_is_with_lanes() -> None:
    network, states = make_network(), some_states()
    order = [0, 4, 1, 5, 3, 2, 7, 6]
    before, after = embeddings(network, states), embeddings(network, states[..., order])
    torch.testing.assert_close(after, before[:, order])


def test_a_column_moves_no_embedding_but_its_own() -> None:
    network, states = make_network(), some_states()
    for column in range(8):
        changed = states.clone()
        changed[..., column] += 0.5
        moved = (embeddings(network, changed) != embeddings(network, states)).any(dim=(0, 2))
        assert moved.nonzero().flatten().tolist() == [column]


def test_ego_vehicles_and_lanes_have_weights_of_their_own() -> None:
    # The same numbers in every column: one embedding for all vehicles, another for both lanes.
    same = some_states()[..., :1].expand(-1, -1, -1, 8)
    ego, vehicle, *rest = embeddings(make_network(), same).unbind(dim=1)
    for other in rest[:4]:
        torch.testing.assert_close(other, vehicle)
    torch.testing.assert_close(rest[4], rest[5])
    assert not torch.allclose(ego, vehicle)
    assert not torch.allclose(ego, rest[4])
    assert not torch.allclose(vehicle, rest[4])


def test_the_scripted_network_equals_the_eager_one() -> None:
    network = make_network()
    scripted = torch.jit.script(network)
    for batch in (1, 7):
        torch.testing.assert_close(scripted(some_states(batch)), network(some_states(batch)))
