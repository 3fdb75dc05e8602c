# SPDX-License-Identifier: Apache-2.0
"""Thresholds and limits of the risk measure (paper, section "Risk Reward"; docs/paper.md)."""

from dataclasses import dataclass, field
from typing import NamedTuple

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.vehicle import (
    EgoLimits,
    TrafficLimits,
    VehicleDimensions,
    require_in_range,
)


class RiskParameters(NamedTuple):
    """RiskConfig flattened to the numbers that kernels read.

    A named tuple of the module, not one made on the fly: numba keeps compiled code on disk only
    for types that another process can find by name.
    """

    stop_margin_m: float
    desired_gap_s: float
    safe_gap_s: float
    leader_distance_m: float
    ego_acceleration_mps2: float
    ego_braking_mps2: float
    ego_fast_mps: float
    ego_slow_mps: float
    traffic_acceleration_mps2: float


@dataclass(frozen=True)
class RiskConfig:
    """What counts as safe.

    ego: a_max^e, a_brake, and v_max (its fast speed). traffic: a_max^i.
    stop_margin_m: d_safe is half the zone plus this. desired_gap_s: t_des, time behind the ego from
    which on all is safe. safe_gap_s: t_safe, below which all is lost.
    vehicle, leader_margin_m: merging lanes only, where a vehicle that has joined is a leader:
    the length of both footprints, and what must stay between them at rest.
    """

    stop_margin_m: float = 0.1
    desired_gap_s: float = 3.0
    safe_gap_s: float = 0.1
    leader_margin_m: float = 1.0
    ego: EgoLimits = field(default_factory=EgoLimits)
    traffic: TrafficLimits = field(default_factory=TrafficLimits)
    vehicle: VehicleDimensions = field(default_factory=VehicleDimensions)

    def __post_init__(self) -> None:
        for name in ("stop_margin_m", "safe_gap_s", "leader_margin_m"):
            value = getattr(self, name)
            if not value >= 0.0:
                raise ConfigurationError(f"RiskConfig.{name} is {value}, expected 0 or more")
        require_in_range(self)
        if not self.desired_gap_s > self.safe_gap_s:
            raise ConfigurationError(
                f"RiskConfig.desired_gap_s is {self.desired_gap_s}, expected more than "
                f"safe_gap_s ({self.safe_gap_s})"
            )

    def parameters(self) -> RiskParameters:
        """Return the numbers that kernels read."""
        return RiskParameters(
            stop_margin_m=self.stop_margin_m,
            desired_gap_s=self.desired_gap_s,
            safe_gap_s=self.safe_gap_s,
            leader_distance_m=self.vehicle.length_m + self.leader_margin_m,
            ego_acceleration_mps2=self.ego.acceleration_mps2,
            ego_braking_mps2=self.ego.braking_mps2,
            ego_fast_mps=self.ego.fast_mps,
            ego_slow_mps=self.ego.slow_mps,
            traffic_acceleration_mps2=self.traffic.acceleration_mps2,
        )
