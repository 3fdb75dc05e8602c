# SPDX-License-Identifier: Apache-2.0
"""The numbers of a scenario and of the vehicles, flattened for compiled code."""

import math
from typing import NamedTuple

from risk_dqn_planner.vehicle import EgoLimits
from sim_bridge.scenarios.fields import CarFollowing, Scenario

NEVER = -1
# A vehicle that does not exist is reported for so long, then perhaps another one.
PHANTOM_LASTS_S = 1.0


class Idm(NamedTuple):
    """`CarFollowing` for kernels; half_inverse_root_ab is 1 / (2 sqrt(a b))."""

    acceleration_mps2: float
    comfortable_mps2: float
    half_inverse_root_ab: float
    time_headway_s: float
    standstill_gap_m: float
    strongest_mps2: float


class EgoDrive(NamedTuple):
    """`EgoLimits` for kernels, as the ego really drives: see `EgoStart.braking_factor`."""

    acceleration_mps2: float
    braking_mps2: float
    slow_mps: float
    fast_mps: float


class Draws(NamedTuple):
    """The scenario's random quantities for kernels: pairs of low and high."""

    ego_distance_m: tuple[float, float]
    ego_speed_mps: tuple[float, float]
    vehicles: tuple[int, int]
    start_distance_m: tuple[float, float]
    desired_speed_mps: tuple[float, float]
    overspeed_factor: float
    headway_s: float
    respawn: bool
    yielding_share: float


class Reaction(NamedTuple):
    """How others brake for the ego: how many inner steps after they see it, -1 for never.

    Not part of Settings, nor is Sensing: what few scenarios use costs the others nothing so.
    """

    after_steps: int
    braking_mps2: float


class Sensing(NamedTuple):
    """How the sensor errs, but for noise; a phantom lasts `phantom_steps` inner steps."""

    bias_mps: float
    missed_share: float
    phantom_share: float
    phantom_steps: int


class Settings(NamedTuple):
    """The numbers that kernels of all scenarios read; steps are inner steps."""

    step_s: float
    decision_steps: int
    limit_steps: int
    ego: EgoDrive
    idm: Idm
    draws: Draws
    sensor_range_m: float
    sensor_offset_m: float
    velocity_noise_mps: float


def settings_of(scenario: Scenario, limits: EgoLimits) -> Settings:
    """Flatten a scenario and the ego's limits."""
    traffic, timing, sensor = scenario.traffic, scenario.timing, scenario.sensor
    speeds = scenario.ego.speed_mps
    draws = Draws(
        ego_distance_m=(scenario.ego.distance_m.low, scenario.ego.distance_m.high),
        ego_speed_mps=(min(speeds.low, limits.fast_mps), min(speeds.high, limits.fast_mps)),
        vehicles=(int(traffic.vehicles.low), int(traffic.vehicles.high)),
        start_distance_m=(traffic.start_distance_m.low, traffic.start_distance_m.high),
        desired_speed_mps=(traffic.desired_speed_mps.low, traffic.desired_speed_mps.high),
        overspeed_factor=traffic.overspeed_factor,
        headway_s=traffic.headway_s,
        respawn=traffic.respawn,
        yielding_share=traffic.yielding_share,
    )
    return Settings(
        step_s=timing.inner_step_s,
        decision_steps=timing.inner_steps,
        limit_steps=timing.limit_steps,
        ego=EgoDrive(
            acceleration_mps2=limits.acceleration_mps2,
            braking_mps2=limits.braking_mps2 * scenario.ego.braking_factor,
            slow_mps=limits.slow_mps,
            fast_mps=limits.fast_mps,
        ),
        idm=idm_of(traffic.car_following),
        draws=draws,
        sensor_range_m=sensor.range_m,
        sensor_offset_m=sensor.forward_offset_m,
        velocity_noise_mps=sensor.velocity_noise_mps,
    )


def reaction_of(scenario: Scenario) -> Reaction:
    """Flatten how others brake for the ego."""
    after_s = scenario.traffic.brakes_for_ego_after_s
    after_steps = NEVER if after_s is None else round(after_s / scenario.timing.inner_step_s)
    return Reaction(after_steps, scenario.traffic.brakes_for_ego_mps2)


def sensing_of(scenario: Scenario) -> Sensing:
    """Flatten how the sensor errs."""
    sensor = scenario.sensor
    return Sensing(
        bias_mps=sensor.velocity_bias_mps,
        missed_share=sensor.missed_share,
        phantom_share=sensor.phantom_share,
        phantom_steps=max(round(PHANTOM_LASTS_S / scenario.timing.inner_step_s), 1),
    )


def idm_of(config: CarFollowing) -> Idm:
    """Flatten the parameters of the car-following model."""
    root = math.sqrt(config.acceleration_mps2 * config.comfortable_braking_mps2)
    return Idm(
        acceleration_mps2=config.acceleration_mps2,
        comfortable_mps2=config.comfortable_braking_mps2,
        half_inverse_root_ab=0.5 / root,
        time_headway_s=config.time_headway_s,
        standstill_gap_m=config.standstill_gap_m,
        strongest_mps2=config.strongest_braking_mps2,
    )
