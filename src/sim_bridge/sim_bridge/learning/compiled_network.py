# SPDX-License-Identifier: Apache-2.0
"""The networks of risk_dqn_planner.policies.network and their gradients as compiled loops.

The paper's, and the one with an outlook of E numbers beside it; E = 0 is the paper's.

The torch module stays the definition: it is what is exported and what runs on the vehicle.
This is how it is trained, several times faster at the paper's batch of 16; a test holds both
together, values and gradients. All weights lie in one flat array, in the module's order.
"""

from typing import NamedTuple

import numpy as np

from risk_dqn_planner.compiled import reordering_kernel
from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.state.encoding import COLUMNS, LANES, ROWS, SCENES, VEHICLES
from sim_bridge.learning.dense import (
    Array,
    Layer,
    backward_input,
    backward_weights,
    forward,
    layer_at,
    rectify,
    rectify_backward,
)

INPUTS = SCENES * ROWS
FEATURES = INPUTS * COLUMNS
EMBEDDING = 20
JOINED = COLUMNS * EMBEDDING
HIDDEN = 120
ACTIONS = len(Action)

_EMBEDDING_WEIGHTS = EMBEDDING * (INPUTS + 1)
_VEHICLE_START = _EMBEDDING_WEIGHTS
_LANE_START = 2 * _EMBEDDING_WEIGHTS
_FIRST_START = 3 * _EMBEDDING_WEIGHTS
_BEHIND_FIRST = HIDDEN * (HIDDEN + 1) + ACTIONS * (HIDDEN + 1)
WEIGHTS = _FIRST_START + HIDDEN * (JOINED + 1) + _BEHIND_FIRST


def outlook_of(weights: int) -> int:
    """Return how many numbers beyond the state a network with so many weights is told."""
    return (weights - WEIGHTS) // HIDDEN


class Layers(NamedTuple):
    """h_ego, h_veh, h_occ (15 -> 20) and the three layers of h_Q, as views of a flat array."""

    ego: Layer
    vehicle: Layer
    lane: Layer
    first: Layer
    second: Layer
    output: Layer


class Signals(NamedTuple):
    """What flows through the network for B states, or the loss's derivative by it.

    inputs_*: (B, 15), (5B, 15), (2B, 15), a history a row; embedded_*: the same with 20;
    joined (B, 160 + E), with an outlook of E numbers; hidden_* (B, 120); q (B, 3).
    """

    inputs_ego: Array
    inputs_vehicle: Array
    inputs_lane: Array
    embedded_ego: Array
    embedded_vehicle: Array
    embedded_lane: Array
    joined: Array
    hidden_first: Array
    hidden_second: Array
    q: Array


def empty_signals(batch: int, outlook: int = 0) -> Signals:
    """Return memory for B states, each with an outlook of so many numbers."""

    def zeros(rows: int, columns: int) -> Array:
        return np.zeros((rows, columns), dtype=np.float32)

    vehicles, lanes = batch * VEHICLES, batch * LANES
    return Signals(
        inputs_ego=zeros(batch, INPUTS),
        inputs_vehicle=zeros(vehicles, INPUTS),
        inputs_lane=zeros(lanes, INPUTS),
        embedded_ego=zeros(batch, EMBEDDING),
        embedded_vehicle=zeros(vehicles, EMBEDDING),
        embedded_lane=zeros(lanes, EMBEDDING),
        joined=zeros(batch, JOINED + outlook),
        hidden_first=zeros(batch, HIDDEN),
        hidden_second=zeros(batch, HIDDEN),
        q=zeros(batch, ACTIONS),
    )


@reordering_kernel
def layers_of(flat: Array, joined: int) -> Layers:
    """Return the layers whose weights, or their derivatives, the flat array (P,) holds.

    joined: how many inputs h_Q has.
    """
    second = _FIRST_START + HIDDEN * (joined + 1)
    output = second + HIDDEN * (HIDDEN + 1)
    return Layers(
        layer_at(flat, 0, EMBEDDING, INPUTS),
        layer_at(flat, _VEHICLE_START, EMBEDDING, INPUTS),
        layer_at(flat, _LANE_START, EMBEDDING, INPUTS),
        layer_at(flat, _FIRST_START, HIDDEN, joined),
        layer_at(flat, second, HIDDEN, HIDDEN),
        layer_at(flat, output, ACTIONS, HIDDEN),
    )


@reordering_kernel
def split_columns(states: Array, signals: Signals) -> None:
    """Give each column of the states (B, 5 x 3 x 8, then E) its row of 15 inputs."""
    for row in range(states.shape[0]):
        for i in range(INPUTS):
            values = states[row, i * COLUMNS : (i + 1) * COLUMNS]
            signals.inputs_ego[row, i] = values[0]
            for k in range(VEHICLES):
                signals.inputs_vehicle[row * VEHICLES + k, i] = values[1 + k]
            for k in range(LANES):
                signals.inputs_lane[row * LANES + k, i] = values[1 + VEHICLES + k]


@reordering_kernel
def join_columns(signals: Signals) -> None:
    """Put the embeddings of a state side by side: ego, vehicles, lanes."""
    for row in range(signals.joined.shape[0]):
        for j in range(EMBEDDING):
            signals.joined[row, j] = signals.embedded_ego[row, j]
            for k in range(VEHICLES):
                value = signals.embedded_vehicle[row * VEHICLES + k, j]
                signals.joined[row, (1 + k) * EMBEDDING + j] = value
            for k in range(LANES):
                value = signals.embedded_lane[row * LANES + k, j]
                signals.joined[row, (1 + VEHICLES + k) * EMBEDDING + j] = value


@reordering_kernel
def join_outlook(states: Array, signals: Signals) -> None:
    """Put the outlook, which follows the states (B, 120 + E), beside the embeddings."""
    for row in range(states.shape[0]):
        for j in range(states.shape[1] - FEATURES):
            signals.joined[row, JOINED + j] = states[row, FEATURES + j]


@reordering_kernel
def part_columns(signals: Signals) -> None:
    """Undo `join_columns`."""
    for row in range(signals.joined.shape[0]):
        for j in range(EMBEDDING):
            signals.embedded_ego[row, j] = signals.joined[row, j]
            for k in range(VEHICLES):
                value = signals.joined[row, (1 + k) * EMBEDDING + j]
                signals.embedded_vehicle[row * VEHICLES + k, j] = value
            for k in range(LANES):
                value = signals.joined[row, (1 + VEHICLES + k) * EMBEDDING + j]
                signals.embedded_lane[row * LANES + k, j] = value


@reordering_kernel
def values(weights: Array, states: Array, signals: Signals) -> None:
    """Fill the signals for the states (B, 120 + E); `signals.q` (B, 3) holds the Q-values."""
    layers = layers_of(weights, signals.joined.shape[1])
    split_columns(states, signals)
    forward(signals.inputs_ego, layers.ego, signals.embedded_ego)
    forward(signals.inputs_vehicle, layers.vehicle, signals.embedded_vehicle)
    forward(signals.inputs_lane, layers.lane, signals.embedded_lane)
    join_columns(signals)
    rectify(signals.joined)
    join_outlook(states, signals)
    forward(signals.joined, layers.first, signals.hidden_first)
    rectify(signals.hidden_first)
    forward(signals.hidden_first, layers.second, signals.hidden_second)
    rectify(signals.hidden_second)
    forward(signals.hidden_second, layers.output, signals.q)


@reordering_kernel
def gradient(weights: Array, signals: Signals, by: Signals, by_weights: Array) -> None:
    """Fill the derivative by the weights (P,) of a loss whose derivative by Q is `by.q`.

    signals: as left by `values`; by: memory for the derivatives on the way.
    """
    joined = signals.joined.shape[1]
    layers, out = layers_of(weights, joined), layers_of(by_weights, joined)
    backward_weights(by.q, signals.hidden_second, out.output)
    backward_input(by.q, layers.output, by.hidden_second)
    rectify_backward(signals.hidden_second, by.hidden_second)
    backward_weights(by.hidden_second, signals.hidden_first, out.second)
    backward_input(by.hidden_second, layers.second, by.hidden_first)
    rectify_backward(signals.hidden_first, by.hidden_first)
    backward_weights(by.hidden_first, signals.joined, out.first)
    backward_input(by.hidden_first, layers.first, by.joined)
    rectify_backward(signals.joined, by.joined)
    part_columns(by)
    backward_weights(by.embedded_ego, signals.inputs_ego, out.ego)
    backward_weights(by.embedded_vehicle, signals.inputs_vehicle, out.vehicle)
    backward_weights(by.embedded_lane, signals.inputs_lane, out.lane)
