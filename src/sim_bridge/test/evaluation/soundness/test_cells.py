# SPDX-License-Identifier: Apache-2.0
import dataclasses
import itertools

import pytest

from risk_dqn_planner.safety.assumptions import NO_CAP_MPS, SafetyAssumptions
from risk_dqn_planner.situation.config import INSTANTANEOUS, TRACKED
from sim_bridge.evaluation.cells import FINITE, RESPAWNING
from sim_bridge.evaluation.soundness.cells import (
    FRONTIER,
    GOAL,
    GRANTABLE,
    GRANTED,
    MAPS,
    MEMORY,
    SCENARIOS,
    VIOLATED,
    missing_scenarios,
    soundness_cells,
)
from sim_bridge.evaluation.soundness.drivers import Drivers, is_sound
from sim_bridge.maps import map_names


def test_the_goal_is_judged_in_every_scenario_on_every_map_with_both_sensors() -> None:
    goal = [each for each in soundness_cells() if each.part == GOAL]
    found = {(e.map_name, e.cell.scenario, e.cell.sensor_forward_m) for e in goal}
    assert found == set(itertools.product(MAPS, SCENARIOS, (0.0, 2.0)))
    assert len(goal) == len(found) == 7 * 4 * 2
    assert set(MAPS) == set(map_names())
    assert all(each.holds and each.limits for each in goal)
    assert {each.cell.memory for each in goal} == {INSTANTANEOUS}


def test_sensor_and_traffic_are_as_the_cell_says() -> None:
    for each in soundness_cells():
        scenario = each.cell.load()
        assert scenario.sensor.forward_offset_m == each.cell.sensor_forward_m
        finite = each.cell.scenario == "finite_dense"
        assert each.cell.traffic == (FINITE if finite else RESPAWNING)
        assert scenario.traffic.respawn is not finite


def test_only_where_speeds_are_noisy_the_check_allows_for_errors() -> None:
    for each in (each for each in soundness_cells() if each.part != GRANTED):
        noisy = each.cell.scenario == "sensor_noise"
        # 4 deviations of 1 m/s.
        assert each.assumptions.speed_error_mps == (4.0 if noisy else 0.0)


def test_accepted_risk_goes_from_standing_ghosts_up_to_none() -> None:
    frontier = [each for each in soundness_cells() if each.part == FRONTIER]
    caps = [each.assumptions.hidden_top_speed_mps for each in frontier]
    assert caps == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, NO_CAP_MPS] * 2
    assert [each.holds for each in frontier] == ([False] * 7 + [True]) * 2
    brakes = [each.cell.load().traffic.brakes_for_ego_after_s for each in frontier]
    assert brakes == [None] * 8 + [1.0] * 8


def test_memory_is_tried_where_something_stands_close() -> None:
    memory = [each for each in soundness_cells() if each.part == MEMORY]
    assert {each.cell.scenario for each in memory} == {"close_small_obstacle", "severe_occlusion"}
    assert {each.cell.memory for each in memory} == {TRACKED}


def test_a_broken_assumption_is_never_held_against_a_policy() -> None:
    broken = [each for each in soundness_cells() if each.part == VIOLATED]
    assert [each.cell.scenario for each in broken if each.holds] == ["base", "base"]
    assert missing_scenarios() == []
    assert len({each.cell.scenario for each in broken}) == 1 + 7


def test_what_breaks_assumptions_is_granted_wherever_the_check_can_be_told() -> None:
    granted = [each for each in soundness_cells() if each.part == GRANTED]
    assert {(each.map_name, each.cell.scenario) for each in granted} == set(
        itertools.product(MAPS, GRANTABLE)
    )
    assert all(each.holds for each in granted)
    told = {each.cell.scenario: each.assumptions for each in granted}
    assert told["delay_200ms"].actuation_delay_s == 0.2
    assert told["delay_500ms"].actuation_delay_s == 0.5
    assert told["weak_brakes"].ego.braking_mps2 == pytest.approx(0.8 * 3.5)
    assert told["others_over_the_limit"].speed_limit_factor == 1.2
    assert told["velocity_bias"].speed_error_mps == 1.0
    plain = [a for a in dataclasses.fields(SafetyAssumptions) if a.name != "period_error_s"]
    for each in granted:
        changed = [
            a.name
            for a in plain
            if getattr(each.assumptions, a.name) != getattr(SafetyAssumptions(), a.name)
        ]
        assert len(changed) == 1


def test_a_map_that_is_none_of_the_project_s_own_has_every_part() -> None:
    cells = soundness_cells(["town.osm"])
    assert {each.map_name for each in cells} == {"town.osm"}
    assert len(cells) == 7 * 2 + 2 * 2 + 8 * 2 + 1 + 7 + 5
    some = soundness_cells(["t_junction"])
    assert {each.part for each in some} == {GOAL, MEMORY, GRANTED}


def test_contestants_take_over_the_cell_s_assumptions() -> None:
    drivers, careful = Drivers(), SafetyAssumptions(speed_error_mps=4.0)
    for name in ("fastest_sound", "look_ahead", "rule_based+supervisor"):
        assert is_sound(name)
        usual, other = drivers.of(name, SafetyAssumptions()), drivers.of(name, careful)
        assert usual.name == other.name == name
        assert usual.hash != other.hash
    assert not is_sound("rule_based")
    hashes = {drivers.of("rule_based", each).hash for each in (SafetyAssumptions(), careful)}
    assert len(hashes) == 1
