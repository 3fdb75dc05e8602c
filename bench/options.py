# SPDX-License-Identifier: Apache-2.0
"""How long is measured: the whole run, or a short one that shows that everything works."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """Rounds, seconds and steps that the parts of the benchmark spend.

    peer_s: processor time of a peer's turn. paper_steps: of the preset `paper`, from which the
    whole run is extrapolated. seeds: trainings of ours whose median counts. sb3_limit_s: when
    stable-baselines3 is stopped, None for ten times ours and a margin; ours_limit_s: when ours is.
    drive_s: of traffic played to the nodes in real time. node_decisions: asked of the policy node
    in each of `node_rounds`.
    """

    rounds: int = 5
    peer_s: float = 3.0
    paper_steps: int = 20_000
    seeds: int = 3
    sb3_limit_s: float | None = None
    updates: int = 300
    decisions: int = 3_000
    situations: int = 400
    ours_limit_s: float = 120.0
    drive_s: float = 100.0
    node_decisions: int = 400
    node_rounds: int = 3


QUICK = Effort(
    rounds=1,
    peer_s=0.5,
    paper_steps=6_000,
    seeds=1,
    sb3_limit_s=3.0,
    updates=30,
    decisions=200,
    situations=20,
    ours_limit_s=3.0,
    drive_s=5.0,
    node_decisions=40,
    node_rounds=1,
)
