# SPDX-License-Identifier: Apache-2.0
"""What the joint check takes for granted of the ego and of all others (docs/safety.md).

In a world that keeps these assumptions an ego that follows the check cannot collide. The
metadata describe each field where it becomes a parameter of a node.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.vehicle import EgoLimits, TrafficLimits, VehicleDimensions, require_in_range

# A hidden vehicle's own cap; no lane allows more, so that the lane's limit holds.
NO_CAP_MPS = 100.0


class SafetyNumbers(NamedTuple):
    """SafetyAssumptions flattened to the numbers that kernels read."""

    period_s: float
    delay_s: float
    delay_least_s: float
    ego_up_mps2: float
    ego_up_most_mps2: float
    ego_down_mps2: float
    ego_down_most_mps2: float
    fast_mps: float
    slow_mps: float
    others_up_mps2: float
    limit_factor: float
    hidden_top_mps: float
    safe_gap_s: float
    zone_margin_m: float
    between_centres_m: float
    clearance_m: float
    reaction_s: float
    follower_down_mps2: float
    follower_gap_m: float
    leader_down_mps2: float
    speed_error_mps: float
    position_error_m: float
    period_error_s: float


@dataclass(frozen=True)
class SafetyAssumptions:
    """Limits of everyone's motion, and hard margins, not desired ones.

    ego: what the ego's actions do at least; its braking is that of Stop. traffic: the others'
    acceleration. vehicle: footprints in a lane that the ego shares with others.
    """

    decision_period_s: float = field(
        default=0.5,
        metadata={"description": "Time from one decision to the next [s]",
                  "minimum": 0.05, "maximum": 5.0},
    )  # fmt: skip
    actuation_delay_s: float = field(
        default=0.0,
        metadata={"description": "From the time of the situation until the ego carries out a "
                  "decision, at most; until then the one before is in force [s]",
                  "minimum": 0.0, "maximum": 5.0},
    )  # fmt: skip
    actuation_jitter_s: float = field(
        default=0.0,
        metadata={"description": "Decisions may be carried out earlier than after "
                  "actuation_delay_s, by so much at most [s]",
                  "minimum": 0.0, "maximum": 5.0},
    )  # fmt: skip
    ego_acceleration_factor: float = field(
        default=1.0,
        metadata={"description": "The ego accelerates at least as hard as ego.acceleration_mps2, "
                  "and at most this many times as hard",
                  "minimum": 1.0, "maximum": 10.0},
    )  # fmt: skip
    ego_braking_factor: float = field(
        default=1.0,
        metadata={"description": "The ego brakes at least as hard as ego.braking_mps2, and at "
                  "most this many times as hard",
                  "minimum": 1.0, "maximum": 10.0},
    )  # fmt: skip
    speed_limit_factor: float = field(
        default=1.0,
        metadata={"description": "Others drive at most this many times their lane's speed limit",
                  "minimum": 0.1, "maximum": 5.0},
    )  # fmt: skip
    hidden_top_speed_mps: float = field(
        default=NO_CAP_MPS,
        metadata={"description": "Hidden vehicles are no faster than this, nor than their lane "
                  "allows; lowering it below the limit accepts risk [m/s]",
                  "minimum": 0.0, "maximum": NO_CAP_MPS},
    )  # fmt: skip
    safe_gap_s: float = field(
        default=0.1,
        metadata={"description": "Least time between the ego's leaving a conflict zone and the "
                  "earliest arrival of anyone else [s]",
                  "minimum": 0.0, "maximum": 30.0},
    )  # fmt: skip
    zone_margin_m: float = field(
        default=0.1,
        metadata={"description": "The ego rests at least this far outside of conflict zones [m]",
                  "minimum": 0.0, "maximum": 20.0},
    )  # fmt: skip
    clearance_m: float = field(
        default=1.0,
        metadata={"description": "Least room between footprints in a lane that the ego shares [m]",
                  "minimum": 0.0, "maximum": 20.0},
    )  # fmt: skip
    follower_reaction_s: float = field(
        default=1.0,
        metadata={"description": "Followers may still accelerate for this long once the ego has "
                  "entered their lane and both can see each other [s]",
                  "minimum": 0.0, "maximum": 10.0},
    )  # fmt: skip
    follower_braking_mps2: float = field(
        default=2.0,
        metadata={"description": "No follower has to brake harder than this [m/s^2]",
                  "minimum": 0.1, "maximum": 20.0},
    )  # fmt: skip
    follower_gap_m: float = field(
        default=2.0,
        metadata={"description": "Room behind the ego below which a vehicle does not take it for "
                  "its leader [m]",
                  "minimum": 0.0, "maximum": 50.0},
    )  # fmt: skip
    leader_braking_mps2: float = field(
        default=8.0,
        metadata={"description": "Vehicles ahead may brake this hard, at least as hard as the "
                  "ego [m/s^2]",
                  "minimum": 0.1, "maximum": 20.0},
    )  # fmt: skip
    speed_error_mps: float = field(
        default=0.0,
        metadata={"description": "Perceived speeds of others are off by no more than this [m/s]",
                  "minimum": 0.0, "maximum": 20.0},
    )  # fmt: skip
    position_error_m: float = field(
        default=0.0,
        metadata={"description": "Perceived places of others along their lanes are off by no more "
                  "than this [m]",
                  "minimum": 0.0, "maximum": 20.0},
    )  # fmt: skip
    period_error_s: float = field(
        default=5.0,
        metadata={"description": "The perceptions of successive decisions are a decision period "
                  "apart but for this; if it is less than the period, speeds are bounded by the "
                  "ways covered in between as well [s]",
                  "minimum": 0.0, "maximum": 5.0},
    )  # fmt: skip
    ego: EgoLimits = field(default_factory=EgoLimits)
    traffic: TrafficLimits = field(default_factory=TrafficLimits)
    vehicle: VehicleDimensions = field(default_factory=VehicleDimensions)

    def __post_init__(self) -> None:
        require_in_range(self)
        if self.actuation_delay_s > self.decision_period_s:
            raise ConfigurationError(
                f"SafetyAssumptions.actuation_delay_s is {self.actuation_delay_s}, expected at "
                f"most decision_period_s ({self.decision_period_s:g}): of several decisions on "
                "their way the check knows the last"
            )
        if self.actuation_jitter_s > self.actuation_delay_s:
            raise ConfigurationError(
                f"SafetyAssumptions.actuation_jitter_s is {self.actuation_jitter_s}, expected at "
                f"most actuation_delay_s ({self.actuation_delay_s:g})"
            )
        least_mps2 = self.ego.braking_mps2 * self.ego_braking_factor
        if self.leader_braking_mps2 < least_mps2:
            raise ConfigurationError(
                f"SafetyAssumptions.leader_braking_mps2 is {self.leader_braking_mps2}, expected at "
                f"least the ego's hardest braking ({least_mps2:g}): a leader that stops more "
                "gently than the ego would be nearest in between, which the check does not look at"
            )

    def numbers(self) -> SafetyNumbers:
        """Return the numbers that kernels read."""
        return SafetyNumbers(
            period_s=self.decision_period_s,
            delay_s=self.actuation_delay_s,
            delay_least_s=self.actuation_delay_s - self.actuation_jitter_s,
            ego_up_mps2=self.ego.acceleration_mps2,
            ego_up_most_mps2=self.ego.acceleration_mps2 * self.ego_acceleration_factor,
            ego_down_mps2=self.ego.braking_mps2,
            ego_down_most_mps2=self.ego.braking_mps2 * self.ego_braking_factor,
            fast_mps=self.ego.fast_mps,
            slow_mps=self.ego.slow_mps,
            others_up_mps2=self.traffic.acceleration_mps2,
            limit_factor=self.speed_limit_factor,
            hidden_top_mps=self.hidden_top_speed_mps,
            safe_gap_s=self.safe_gap_s,
            zone_margin_m=self.zone_margin_m,
            between_centres_m=self.vehicle.length_m,
            clearance_m=self.clearance_m,
            reaction_s=self.follower_reaction_s,
            follower_down_mps2=self.follower_braking_mps2,
            follower_gap_m=self.follower_gap_m,
            leader_down_mps2=self.leader_braking_mps2,
            speed_error_mps=self.speed_error_mps,
            position_error_m=self.position_error_m,
            period_error_s=self.period_error_s,
        )
