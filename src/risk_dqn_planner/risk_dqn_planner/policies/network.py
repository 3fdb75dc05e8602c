# SPDX-License-Identifier: Apache-2.0
"""The paper's deep Q network (section "DQN Structure", Table I)."""

import torch
from torch import nn

from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.state.encoding import COLUMNS, ROWS, SCENES, VEHICLES

HISTORY = SCENES * ROWS
FEATURES = 20
HIDDEN = 120


class Layer(nn.Linear):
    """A linear layer that leaves its sizes out of TorchScript.

    Torch writes them as constants in an order that varies from process to process; without
    them the same network always makes the same file.
    """

    __constants__: list[str] = []  # noqa: RUF012 (as torch declares it)


class RiskDqn(nn.Module):
    """Q values of the three actions from the last five scenes.

    The 15 numbers of the ego, of each vehicle and of each lane go through h_ego, h_veh and
    h_occ, 15 -> 20; vehicles share their weights, lanes as well. The 8 x 20 features then go
    through h_Q, 160 -> 120 -> 120 -> 3. All hidden layers are rectified.
    """

    def __init__(self) -> None:
        super().__init__()
        self.h_ego = Layer(HISTORY, FEATURES)
        self.h_veh = Layer(HISTORY, FEATURES)
        self.h_occ = Layer(HISTORY, FEATURES)
        self.h_q = _head(COLUMNS * FEATURES)
        self.vehicles = VEHICLES

    def forward(self, state: torch.Tensor) -> torch.Tensor:
        """Return Q values, shape (B, 3), of states, shape (B, 5, 3, 8)."""
        histories = state.permute(0, 3, 1, 2).flatten(2)  # (B, 8, 15)
        ego = self.h_ego(histories[:, :1])
        vehicles = self.h_veh(histories[:, 1 : 1 + self.vehicles])
        lanes = self.h_occ(histories[:, 1 + self.vehicles :])
        features = torch.relu(torch.cat((ego, vehicles, lanes), dim=1))
        values: torch.Tensor = self.h_q(features.flatten(1))
        return values


class OutlookDqn(nn.Module):
    """The paper's network with an outlook (ours, see outlook.py) beside the 8 x 20 features.

    The outlook is known to lie in [-1, 1] and goes into h_Q as it is.
    """

    def __init__(self, outlook: int) -> None:
        """Take how many numbers the outlook has."""
        super().__init__()
        self.h_ego = Layer(HISTORY, FEATURES)
        self.h_veh = Layer(HISTORY, FEATURES)
        self.h_occ = Layer(HISTORY, FEATURES)
        self.h_q = _head(COLUMNS * FEATURES + outlook)
        self.vehicles = VEHICLES

    def forward(self, state: torch.Tensor, outlook: torch.Tensor) -> torch.Tensor:
        """Return Q values, shape (B, 3), of states (B, 5, 3, 8) with their outlook (B, E)."""
        histories = state.permute(0, 3, 1, 2).flatten(2)  # (B, 8, 15)
        ego = self.h_ego(histories[:, :1])
        vehicles = self.h_veh(histories[:, 1 : 1 + self.vehicles])
        lanes = self.h_occ(histories[:, 1 + self.vehicles :])
        features = torch.relu(torch.cat((ego, vehicles, lanes), dim=1))
        values: torch.Tensor = self.h_q(torch.cat((features.flatten(1), outlook), dim=1))
        return values


def _head(inputs: int) -> nn.Sequential:
    """Return h_Q for so many inputs."""
    return nn.Sequential(
        Layer(inputs, HIDDEN),
        nn.ReLU(),
        Layer(HIDDEN, HIDDEN),
        nn.ReLU(),
        Layer(HIDDEN, len(Action)),
    )
