# SPDX-License-Identifier: Apache-2.0
"""The set `soundness`: where no collision may happen, what accepted risk buys, what breaks it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

from risk_dqn_planner.safety.assumptions import NO_CAP_MPS, SafetyAssumptions
from risk_dqn_planner.situation.config import TRACKED
from risk_dqn_planner.vehicle import EgoLimits
from sim_bridge.evaluation.cells import BASE, FINITE, RESPAWNING, Cell
from sim_bridge.scenarios.loading import load_scenario, scenario_names

FASTEST_SOUND, LOOK_AHEAD, RULE_BASED = "fastest_sound", "look_ahead", "rule_based"
TUNED, SUPERVISED, SOUND_DQN = "tuned", "tuned+supervisor", "sound_dqn"
POLICIES = (FASTEST_SOUND, LOOK_AHEAD, SOUND_DQN, SUPERVISED, TUNED, RULE_BASED)
# Those that search at each decision, and so take a hundred times as long.
SEARCHING = (LOOK_AHEAD,)
# Those that choose among sound actions themselves, without a search.
UNAIDED = (FASTEST_SOUND, SOUND_DQN)
# Those whose every action is sound where the assumptions hold.
SOUND = (FASTEST_SOUND, LOOK_AHEAD, SOUND_DQN, SUPERVISED)

GOAL, MEMORY, FRONTIER = "goal", "memory", "frontier"
VIOLATED, GRANTED = "violated", "granted"
PARTS = (GOAL, MEMORY, FRONTIER, VIOLATED, GRANTED)
MAPS = ("four_way", "t_junction", "multi_lane", "roundabout")
OCCLUDED, CLOSE, NOISE = "severe_occlusion", "close_small_obstacle", "sensor_noise"
SCENARIOS = (
    BASE, "dense_traffic", "finite_dense", OCCLUDED, NOISE, "short_sensor_range", CLOSE,
)  # fmt: skip
# At the ego's centre, and at the front of a vehicle of 4 m.
SENSORS_M = (0.0, 2.0)
# Highest speeds ascribed to hidden vehicles; the last one is their lane's limit: no risk accepted.
HIDDEN_TOP_MPS = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, NO_CAP_MPS)
# Traffic that never cares for the ego, and traffic that brakes so long after it could see it.
BRAKES_AFTER_S = (None, 1.0)
VIOLATIONS = (
    "others_over_the_limit", "weak_brakes", "delay_200ms", "delay_500ms", "missed_detections",
    "phantom_detections", "velocity_bias",
)  # fmt: skip
# Those of them that the check can be told of.
GRANTABLE = (
    "others_over_the_limit", "weak_brakes", "delay_200ms", "delay_500ms", "velocity_bias",
)  # fmt: skip
FRONTIER_ON, VIOLATED_ON = "four_way", ("four_way", "roundabout")
# Errors of perceived speeds have no bound; 1 of 16 000 lies outside of so many deviations.
NOISE_DEVIATIONS = 4.0


@dataclass(frozen=True)
class SoundnessCell:
    """A cell of one part of the set.

    assumptions: of the sound policies in it, and of the sound limit. holds: whether the simulated
    world keeps them. limits: whether both limits are searched.
    """

    part: str
    map_name: str
    cell: Cell
    assumptions: SafetyAssumptions = field(default_factory=SafetyAssumptions)
    policies: tuple[str, ...] = POLICIES
    holds: bool = True
    limits: bool = False


def assumptions_for(cell: Cell) -> SafetyAssumptions:
    """Return the default assumptions, with a bound on the errors that the sensor makes."""
    noise_mps = cell.load().sensor.velocity_noise_mps
    # The simulation decides once in each period, exactly.
    return SafetyAssumptions(speed_error_mps=NOISE_DEVIATIONS * noise_mps, period_error_s=0.0)


def granting_assumptions(cell: Cell) -> SafetyAssumptions:
    """Return assumptions that a world keeps which does not keep the default ones."""
    scenario = cell.load()
    ego, limits = scenario.ego, EgoLimits()
    usual = assumptions_for(cell)
    return replace(
        usual,
        actuation_delay_s=ego.actuation_delay_s,
        speed_limit_factor=scenario.traffic.overspeed_factor,
        speed_error_mps=usual.speed_error_mps + abs(scenario.sensor.velocity_bias_mps),
        ego=replace(limits, braking_mps2=limits.braking_mps2 * ego.braking_factor),
    )


def soundness_cells(maps: Sequence[str] = MAPS) -> list[SoundnessCell]:
    """Return all cells on these maps whose scenarios there are.

    maps: names, or .osm files, which have every part of the set; of the project's own maps the
    frontier and the broken assumptions take some only.
    """
    frontier = [each for each in maps if each == FRONTIER_ON or each not in MAPS]
    violated = [each for each in maps if each in VIOLATED_ON or each not in MAPS]
    return [
        *_goal(maps),
        *_memory(maps),
        *_frontier(frontier),
        *_violated(violated),
        *_granted(maps),
    ]


def missing_scenarios() -> list[str]:
    """Return the scenarios of the set that are not in this version."""
    return sorted({*SCENARIOS, *VIOLATIONS} - set(scenario_names()))


def _traffic(scenario: str) -> str:
    return RESPAWNING if load_scenario(scenario).traffic.respawn else FINITE


def _goal(maps: Sequence[str]) -> Iterator[SoundnessCell]:
    for map_name in maps:
        for scenario in SCENARIOS:
            for forward_m in SENSORS_M:
                cell = Cell(scenario, _traffic(scenario), sensor_forward_m=forward_m)
                yield SoundnessCell(GOAL, map_name, cell, assumptions_for(cell), limits=True)


def _memory(maps: Sequence[str]) -> Iterator[SoundnessCell]:
    """Where something stands close, and the ego has seen behind it before."""
    policies = (FASTEST_SOUND, LOOK_AHEAD)
    for map_name in maps:
        for scenario in (CLOSE, OCCLUDED):
            for forward_m in SENSORS_M:
                cell = Cell(
                    scenario, _traffic(scenario), sensor_forward_m=forward_m, memory=TRACKED
                )
                yield SoundnessCell(MEMORY, map_name, cell, policies=policies, limits=True)


def _frontier(maps: Sequence[str]) -> Iterator[SoundnessCell]:
    """Where the worst case forbids most; a hidden vehicle that is slower than the truth is risk."""
    policies = (FASTEST_SOUND, LOOK_AHEAD, SOUND_DQN)
    for map_name, after_s in product(maps, BRAKES_AFTER_S):
        cell = Cell(OCCLUDED, RESPAWNING, sensor_forward_m=0.0, brakes_for_ego_after_s=after_s)
        for top_mps in HIDDEN_TOP_MPS:
            own = SafetyAssumptions(hidden_top_speed_mps=top_mps)
            holds = top_mps == NO_CAP_MPS
            yield SoundnessCell(FRONTIER, map_name, cell, own, policies, holds, limits=holds)


def _violated(maps: Sequence[str]) -> Iterator[SoundnessCell]:
    """Worlds that break one assumption each, and base, which keeps them all."""
    for map_name in maps:
        for scenario in (BASE, *(each for each in VIOLATIONS if each in scenario_names())):
            cell = Cell(scenario, _traffic(scenario), sensor_forward_m=0.0)
            yield SoundnessCell(VIOLATED, map_name, cell, holds=scenario == BASE)


def _granted(maps: Sequence[str]) -> Iterator[SoundnessCell]:
    """The same worlds, and a check that is told of them."""
    for map_name in maps:
        for scenario in (each for each in GRANTABLE if each in scenario_names()):
            cell = Cell(scenario, _traffic(scenario), sensor_forward_m=0.0)
            own = granting_assumptions(cell)
            yield SoundnessCell(GRANTED, map_name, cell, own, SOUND)
