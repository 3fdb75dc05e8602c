# SPDX-License-Identifier: Apache-2.0
from pathlib import Path
from typing import Any

import pytest

from risk_dqn_planner.errors import ScenarioError
from sim_bridge.scenarios.fields import EgoStart, Interval, Scenario, Sensor, Timing, Traffic
from sim_bridge.scenarios.loading import load_scenario, scenario_names


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / f"{name}.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_package_has_every_scenario_of_the_paper_and_finite_traffic():
    assert {
        "base",
        "dense_traffic",
        "severe_occlusion",
        "sensor_noise",
        "short_sensor_range",
        "close_small_obstacle",
        "finite_traffic",
        "finite_dense",
    } <= set(scenario_names())


def test_the_package_has_every_violated_assumption_and_traffic_that_brakes():
    assert {
        "others_over_the_limit",
        "weak_brakes",
        "delay_200ms",
        "delay_500ms",
        "missed_detections",
        "phantom_detections",
        "velocity_bias",
        "braking_traffic",
    } <= set(scenario_names())


def test_braking_traffic_is_a_field_that_any_scenario_takes_and_gives_back(tmp_path: Path):
    text = "extends: severe_occlusion\ntraffic:\n  brakes_for_ego_after_s: 1\n"
    mine = load_scenario(write(tmp_path, "mine", text))
    assert mine.traffic.brakes_for_ego_after_s == 1.0
    assert mine.obstacles == load_scenario("severe_occlusion").obstacles
    text = "extends: mine\ntraffic:\n  brakes_for_ego_after_s: null\n"
    assert load_scenario(write(tmp_path, "never", text)).traffic == load_scenario("base").traffic


def test_every_scenario_of_the_package_is_valid_and_says_what_it_is():
    for name in scenario_names():
        scenario = load_scenario(name)
        assert scenario.name == name
        assert scenario.description.endswith(".")


def test_the_file_of_base_holds_the_defaults_of_the_fields():
    base = load_scenario("base")
    assert base == Scenario("base", base.description)


@pytest.mark.parametrize(
    ("name", "difference"),
    [
        ("sensor_noise", {"sensor": {"velocity_noise_mps": 1.0}}),
        ("short_sensor_range", {"sensor": {"range_m": 40.0}}),
        ("finite_traffic", {"traffic": {"respawn": False}}),
    ],
)
def test_a_variant_differs_from_base_in_what_its_name_says(name: str, difference: dict[str, Any]):
    base, variant = load_scenario("base"), load_scenario(name)
    for group in ("ego", "traffic", "obstacles", "sensor", "timing"):
        for field, value in vars(getattr(variant, group)).items():
            expected = difference.get(group, {}).get(field, getattr(getattr(base, group), field))
            assert value == expected, f"{group}.{field}"


def test_a_close_small_obstacle_is_as_small_and_as_close_as_specified():
    obstacles = load_scenario("close_small_obstacle").obstacles
    assert (obstacles.length_m, obstacles.width_m) == (Interval(2, 6), Interval(2, 6))
    assert obstacles.gap_cross_m == Interval(0.3, 1.5)


def test_a_users_file_extends_a_scenario_of_the_package(tmp_path: Path):
    text = "extends: dense_traffic\ndescription: Mine.\ntraffic:\n  yielding_share: 0.5\n"
    mine = load_scenario(write(tmp_path, "mine", text))
    dense = load_scenario("dense_traffic")
    assert mine.name == "mine"
    assert mine.description == "Mine."
    assert mine.traffic.yielding_share == 0.5
    assert mine.traffic.vehicles == dense.traffic.vehicles


def test_a_users_file_extends_another_one_beside_it(tmp_path: Path):
    write(tmp_path, "first", "sensor:\n  range_m: 33\n")
    second = load_scenario(write(tmp_path, "second", "extends: first\n"))
    assert second.sensor.range_m == 33.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sensor:\n  rang_m: 40\n", ["sensor.rang_m", "range_m"]),
        ("sensor:\n  range_m: far\n", ["sensor.range_m", "'far'", "a number"]),
        ("sensor:\n  range_m: -1\n", ["Sensor.range_m", "-1", "above 0"]),
        ("traffic:\n  vehicles: 3\n", ["traffic.vehicles", "3", "[low, high]"]),
        ("traffic:\n  vehicles: [0.5, 2]\n", ["Traffic.vehicles", "whole numbers"]),
        ("traffic:\n  desired_speed_mps: [5, 3]\n", ["traffic.desired_speed_mps", "lower one"]),
        ("traffic:\n  respawn: 1\n", ["traffic.respawn", "true or false"]),
        ("traffic:\n  brakes_for_ego_after_s: late\n", ["brakes_for_ego_after_s", "a number"]),
        ("traffic:\n  overspeed_factor: null\n", ["traffic.overspeed_factor", "a number"]),
        ("ego:\n  actuation_delay_s: 0.15\n", ["EgoStart.actuation_delay_s", "inner_step_s"]),
        ("obstacles: 3\n", ["obstacles", "a group of fields"]),
        ("obstacles:\n  per_side: true\n", ["obstacles.per_side", "a whole number"]),
        ("sensor:\n  vehicles_occlude: true\n", ["Sensor.vehicles_occlude", "not supported"]),
        ("- 1\n", ["expected a mapping"]),
        ("a: [\n", ["cannot read"]),
        ("extends: nothing\n", ["extends 'nothing'"]),
        ("extends: broken\n", ["extends itself"]),
    ],
)
def test_a_broken_file_is_refused_with_its_path_and_field(
    tmp_path: Path, text: str, words: list[str]
):
    path = write(tmp_path, "broken", text)
    with pytest.raises(ScenarioError) as error:
        load_scenario(path)
    for word in [str(path), *words]:
        assert word in str(error.value)


def test_an_unknown_name_is_answered_with_the_known_ones():
    with pytest.raises(ScenarioError, match=r"'bose'.*base, .*close_small_obstacle"):
        load_scenario("bose")


def test_the_decision_period_must_be_a_multiple_of_the_inner_step():
    with pytest.raises(ScenarioError, match=r"decision_period_s is 0\.5"):
        Timing(inner_step_s=0.15)


def test_a_default_scenario_takes_five_inner_steps_a_decision_and_lasts_600():
    assert (Timing().inner_steps, Timing().limit_steps) == (5, 600)


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        (Traffic, {"yielding_share": 1.1}),
        (Traffic, {"headway_s": -0.1}),
        (Traffic, {"vehicles": Interval(-1, 2)}),
        (Traffic, {"overspeed_factor": 0.0}),
        (Traffic, {"brakes_for_ego_after_s": -0.1}),
        (Traffic, {"brakes_for_ego_mps2": 0.0}),
        (EgoStart, {"braking_factor": 0.0}),
        (EgoStart, {"actuation_delay_s": -0.1}),
        (EgoStart, {"actuation_delay_s": 11.0}),
        (Sensor, {"velocity_noise_mps": -1.0}),
        (Sensor, {"velocity_bias_mps": float("nan")}),
        (Sensor, {"missed_share": 1.1}),
        (Sensor, {"phantom_share": -0.1}),
        (Sensor, {"range_m": float("inf")}),
    ],
)
def test_fields_out_of_range_are_refused_at_birth(kind: type, fields: dict[str, Any]):
    with pytest.raises(ScenarioError, match=next(iter(fields))):
        kind(**fields)
