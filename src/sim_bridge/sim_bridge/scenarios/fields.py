# SPDX-License-Identifier: Apache-2.0
"""What is drawn at random in an episode, and what stays fixed: one scenario, validated at birth."""

import math
from dataclasses import dataclass, field

from risk_dqn_planner.errors import ScenarioError

# Decisions under way are kept, so there is an end to delays.
_LONGEST_DELAY_S = 10.0


def _require(holds: bool, config: object, name: str, expected: str) -> None:
    if not holds:
        value = getattr(config, name)
        raise ScenarioError(f"{type(config).__name__}.{name} is {value}, expected {expected}")


@dataclass(frozen=True)
class Interval:
    """Values are drawn uniformly from [low, high]."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low <= self.high):
            raise ScenarioError(
                f"[{self.low}, {self.high}] is no interval, expected two finite numbers, "
                "the lower one first"
            )

    def __str__(self) -> str:
        return f"[{self.low:g}, {self.high:g}]"


@dataclass(frozen=True)
class EgoStart:
    """Where and how fast the ego starts, and how far it falls short of what its planner believes.

    distance_m: of its stop position before the stop line. speed_mps: at the start.
    braking_factor: the ego really brakes with this share of its braking. actuation_delay_s: so
    much later a decision takes effect; until then the one before is in force, and the first one
    finds the ego at its speed of the start.
    """

    distance_m: Interval = Interval(20.0, 50.0)
    speed_mps: Interval = Interval(2.0, 5.0)
    braking_factor: float = 1.0
    actuation_delay_s: float = 0.0

    def __post_init__(self) -> None:
        _require(0.0 < self.braking_factor < math.inf, self, "braking_factor", "a number above 0")
        delay_s = self.actuation_delay_s
        _require(0.0 <= delay_s <= _LONGEST_DELAY_S, self, "actuation_delay_s", "0 to 10")
        for name in ("distance_m", "speed_mps"):
            _require(getattr(self, name).low >= 0.0, self, name, "nothing below 0")


@dataclass(frozen=True)
class CarFollowing:
    """Parameters of the Intelligent Driver Model (Treiber, Hennecke, Helbing 2000).

    acceleration_mps2: a, must not exceed what the planner's worst case grants others (2 m/s^2).
    comfortable_braking_mps2: b. time_headway_s: T. standstill_gap_m: s0.
    strongest_braking_mps2: the model never brakes harder.
    """

    acceleration_mps2: float = 1.5
    comfortable_braking_mps2: float = 2.0
    time_headway_s: float = 1.2
    standstill_gap_m: float = 2.0
    strongest_braking_mps2: float = 8.0

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            _require(getattr(self, name) > 0.0, self, name, "a number above 0")


@dataclass(frozen=True)
class Traffic:
    """The other vehicles.

    vehicles: how many, drawn as an integer. start_distance_m: to the centre of their conflict
    zone. desired_speed_mps: cut to the speed limit of their lane. overspeed_factor: then they
    want to drive so many times this speed, above the limit too. headway_s: least time to the
    vehicle ahead when one is placed. respawn: one that has left comes again far upstream, as
    a new vehicle. yielding_share: of vehicles that let the ego go first; the paper has none.
    brakes_for_ego_after_s: so long after a driver could first see the ego in its way it brakes
    (see simulation/reacting.py), None for never; brakes_for_ego_mps2: as hard as this at most.
    """

    vehicles: Interval = Interval(1, 6)
    start_distance_m: Interval = Interval(10.0, 80.0)
    desired_speed_mps: Interval = Interval(3.5, 7.0)
    overspeed_factor: float = 1.0
    headway_s: float = 1.5
    respawn: bool = True
    yielding_share: float = 0.0
    brakes_for_ego_after_s: float | None = None
    brakes_for_ego_mps2: float = 4.0
    car_following: CarFollowing = field(default_factory=CarFollowing)

    def __post_init__(self) -> None:
        low, high = self.vehicles.low, self.vehicles.high
        whole = low == int(low) and high == int(high) and low >= 0
        _require(whole, self, "vehicles", "two whole numbers, none below 0")
        _require(self.desired_speed_mps.low > 0.0, self, "desired_speed_mps", "only above 0")
        _require(self.start_distance_m.low >= 0.0, self, "start_distance_m", "nothing below 0")
        _require(self.headway_s >= 0.0, self, "headway_s", "0 or more")
        _require(0.0 <= self.yielding_share <= 1.0, self, "yielding_share", "0 to 1")
        factor, after_s = self.overspeed_factor, self.brakes_for_ego_after_s
        _require(0.0 < factor < math.inf, self, "overspeed_factor", "a number above 0")
        never_or_later = after_s is None or 0.0 <= after_s < math.inf
        _require(never_or_later, self, "brakes_for_ego_after_s", "0 or more, or null for never")
        braking = 0.0 < self.brakes_for_ego_mps2 < math.inf
        _require(braking, self, "brakes_for_ego_mps2", "a number above 0")


@dataclass(frozen=True)
class Obstacles:
    """Rectangles beside the ego's lane, just before the first conflict zone.

    per_side: how many on the left and as many on the right. length_m: along the ego's lane;
    width_m: away from it. gap_ego_m: to the ego's lane and the roads along it; gap_cross_m: to
    the intersecting lanes. required: whether a side without room is an error, else it stays free.
    """

    per_side: int = 1
    length_m: Interval = Interval(4.0, 15.0)
    width_m: Interval = Interval(4.0, 15.0)
    gap_ego_m: Interval = Interval(2.0, 8.0)
    gap_cross_m: Interval = Interval(3.0, 11.0)
    required: bool = False

    def __post_init__(self) -> None:
        _require(self.per_side in range(5), self, "per_side", "a whole number from 0 to 4")
        for name in ("length_m", "width_m"):
            _require(getattr(self, name).low > 0.0, self, name, "only above 0")
        for name in ("gap_ego_m", "gap_cross_m"):
            _require(getattr(self, name).low >= 0.0, self, name, "nothing below 0")


@dataclass(frozen=True)
class Sensor:
    """What the ego perceives.

    range_m: of sight. forward_offset_m: the sensor ahead of the ego's centre.
    velocity_noise_mps: standard deviation on perceived speeds; velocity_bias_mps: added to all
    of them. missed_share: of looks at a vehicle that do not find it, though the place where it
    is counts as seen. phantom_share: of seconds in which a vehicle that does not exist is
    reported, for each lane, see perception/phantoms.py. vehicles_occlude: whether other vehicles
    cut the sight as obstacles do (not supported yet).
    """

    range_m: float = 70.0
    forward_offset_m: float = 0.0
    velocity_noise_mps: float = 0.0
    velocity_bias_mps: float = 0.0
    missed_share: float = 0.0
    phantom_share: float = 0.0
    vehicles_occlude: bool = False

    def __post_init__(self) -> None:
        _require(0.0 < self.range_m < math.inf, self, "range_m", "a number above 0")
        _require(abs(self.forward_offset_m) < 10.0, self, "forward_offset_m", "less than 10 m")
        _require(self.velocity_noise_mps >= 0.0, self, "velocity_noise_mps", "0 or more")
        _require(math.isfinite(self.velocity_bias_mps), self, "velocity_bias_mps", "a number")
        for name in ("missed_share", "phantom_share"):
            _require(0.0 <= getattr(self, name) <= 1.0, self, name, "0 to 1")
        _require(not self.vehicles_occlude, self, "vehicles_occlude", "false: not supported yet")


@dataclass(frozen=True)
class Timing:
    """Time limit of an episode, time between decisions, and the simulation's step."""

    limit_s: float = 60.0
    decision_period_s: float = 0.5
    inner_step_s: float = 0.1

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            _require(getattr(self, name) > 0.0, self, name, "a number above 0")
        for name in ("decision_period_s", "limit_s"):
            steps = getattr(self, name) / self.inner_step_s
            expected = f"a multiple of inner_step_s ({self.inner_step_s})"
            _require(abs(steps - round(steps)) < 1e-6, self, name, expected)

    @property
    def inner_steps(self) -> int:
        """Inner steps in a decision period."""
        return round(self.decision_period_s / self.inner_step_s)

    @property
    def limit_steps(self) -> int:
        """Inner steps until the time limit."""
        return round(self.limit_s / self.inner_step_s)


@dataclass(frozen=True)
class Scenario:
    """A named distribution of episodes; `description` is one sentence for people."""

    name: str
    description: str
    ego: EgoStart = field(default_factory=EgoStart)
    traffic: Traffic = field(default_factory=Traffic)
    obstacles: Obstacles = field(default_factory=Obstacles)
    sensor: Sensor = field(default_factory=Sensor)
    timing: Timing = field(default_factory=Timing)

    def __post_init__(self) -> None:
        if not self.name:
            raise ScenarioError("a scenario has no name")
        for group, name in (("ego", "actuation_delay_s"), ("traffic", "brakes_for_ego_after_s")):
            config, step_s = getattr(self, group), self.timing.inner_step_s
            steps = (getattr(config, name) or 0.0) / step_s
            expected = f"a multiple of timing.inner_step_s ({step_s})"
            _require(abs(steps - round(steps)) < 1e-6, config, name, expected)
