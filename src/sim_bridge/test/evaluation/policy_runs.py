# SPDX-License-Identifier: Apache-2.0
"""Finished training runs of untrained networks, as `train` leaves them."""

import json
from collections.abc import Sequence
from pathlib import Path

import torch

from risk_dqn_planner.policies.network import RiskDqn
from risk_dqn_planner.policies.policy_file import PolicyContract, save_policy


def a_run(
    folder: Path,
    seed: int,
    name: str = "tuned",
    reward: str = "risk",
    weights: int = 0,
    success: Sequence[float] = (),
) -> str:
    """Write a run; return its policy's hash.

    weights: seed of the network's weights. success: of the running evaluations, 100 steps apart.
    """
    folder.mkdir(parents=True)
    outcome = {"run": {"config": {"preset": "tuned"}, "reward": reward, "seed": seed}}
    torch.manual_seed(weights)
    contract = PolicyContract(name=name, training=outcome)
    sha256 = save_policy(folder / "policy.pt", RiskDqn(), contract)
    result = {**outcome, "name": name, "sha256": sha256}
    (folder / "result.json").write_text(json.dumps(result))
    history = [
        {"steps": 100 * k, "evaluation": {"success": rate}} for k, rate in enumerate(success)
    ]
    (folder / "history.json").write_text(json.dumps(history))
    return sha256
