# SPDX-License-Identifier: Apache-2.0
"""A sensor that errs: speeds that are off, vehicles that are missed, others that are not there."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import Point, Polygon

from risk_dqn_planner.intersection.model import IntersectionModel
from sim_bridge.scenarios.fields import Scenario, Sensor
from sim_bridge.simulation.simulation import Simulation

STOP = 0


def looking(model: IntersectionModel, scenario: Scenario, batch: int, sensor: Sensor) -> Simulation:
    """A simulation whose episodes have begun."""
    simulation = Simulation(model, replace(scenario, sensor=sensor), batch)
    simulation.reset(np.arange(batch))
    return simulation


def test_a_bias_is_added_to_every_measured_speed_and_to_nothing_else(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    plain = looking(crossing_model, busy, 50, Sensor())
    biased = looking(crossing_model, busy, 50, Sensor(velocity_bias_mps=-1.0))
    for _ in range(5):
        true, found = plain.situations(), biased.situations()
        mask = true.vehicle_mask
        assert np.array_equal(mask, found.vehicle_mask)
        # Lanes are straight, so that all of a speed is along them.
        off = found.vehicle_speed_mps - true.vehicle_speed_mps
        assert off[mask] == pytest.approx(np.full(mask.sum(), -1.0))
        assert np.array_equal(true.vehicle_distance_m[mask], found.vehicle_distance_m[mask])
        poses = biased.vehicle_poses()
        off = (poses.measured_speed_mps - poses.speed_mps)[poses.mask]
        assert off == pytest.approx(np.full(len(off), -1.0))
        plain.step([STOP] * 50)
        biased.step([STOP] * 50)


def test_the_missed_share_of_seen_vehicles_is_absent(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    share, seen, missed, twice = 0.05, 0, 0, 0
    plain = looking(crossing_model, busy, 400, Sensor())
    missing = looking(crossing_model, busy, 400, Sensor(missed_share=share))
    before = np.zeros((400, 6), dtype=np.bool_)
    for _ in range(18):
        sees, finds = plain.vehicle_poses(), missing.vehicle_poses()
        in_sight = sees.mask & ~sees.hidden
        not_found = in_sight & finds.hidden
        # Nobody is found that is out of sight.
        assert (finds.hidden | ~sees.hidden).all()
        seen, missed = seen + int(in_sight.sum()), missed + int(not_found.sum())
        twice += int((not_found & before).sum())
        before = not_found
        plain.inner_step([STOP] * 400)
        missing.inner_step([STOP] * 400)
    spread = math.sqrt(share * (1.0 - share) / seen)
    assert seen > 10_000
    assert abs(missed / seen - share) < 4.0 * spread
    # Each look is drawn anew.
    assert twice / missed == pytest.approx(share, abs=0.05)


def test_the_place_of_a_missed_vehicle_counts_as_seen(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    plain = looking(crossing_model, busy, 40, Sensor())
    blind = looking(crossing_model, busy, 40, Sensor(missed_share=1.0))
    sees, finds = plain.situations(), blind.situations()
    assert sees.vehicle_mask.any()
    assert not finds.vehicle_mask.any()
    assert np.array_equal(sees.lane_hidden_distance_m, finds.lane_hidden_distance_m)


def test_looking_again_misses_the_same_vehicles(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    simulation = looking(crossing_model, busy, 40, Sensor(missed_share=0.5))
    first = simulation.situations()
    poses = simulation.vehicle_poses()
    again = simulation.situations()
    assert np.array_equal(first.vehicle_mask, again.vehicle_mask)
    found = np.sort(np.where(poses.mask & ~poses.hidden, poses.id, 0), axis=1)
    for row in range(40):
        ids = set(first.vehicle_id[row, first.vehicle_mask[row]].tolist())
        assert ids <= set(found[row].tolist())


def test_phantoms_come_on_every_lane_with_their_share_last_a_second_and_drive_on(
    crossing_model: IntersectionModel, empty_road: Scenario
) -> None:
    share, batch, seconds = 0.2, 500, 10
    simulation = looking(crossing_model, empty_road, batch, Sensor(phantom_share=share))
    reported = []
    for _ in range(seconds):
        first = simulation.phantom_poses()
        for _ in range(9):
            simulation.inner_step([STOP] * batch)
        last = simulation.phantom_poses()
        simulation.inner_step([STOP] * batch)
        both = first.mask & last.mask
        assert np.array_equal(first.id[both], last.id[both])
        way = np.hypot(last.x_m - first.x_m, last.y_m - first.y_m)[both]
        assert way == pytest.approx(0.9 * first.measured_speed_mps[both])
        reported.append(first.mask)
    # Vehicles are drawn from 70 m before the zone's middle to 3 m behind; from before the line a
    # little less of that is in sight.
    for lane in range(2):
        found = np.mean([mask[:, lane] for mask in reported])
        spread = math.sqrt(share * (1.0 - share) / (batch * seconds))
        assert 0.7 * share < found < share + 4.0 * spread


def test_phantoms_are_on_lanes_at_seen_places_and_the_planner_gets_them(
    crossing_model: IntersectionModel, busy: Scenario
) -> None:
    simulation = looking(crossing_model, busy, 100, Sensor(phantom_share=0.5))
    plain = looking(crossing_model, busy, 100, Sensor())
    for _ in range(6):
        true, found = plain.situations(), simulation.situations()
        phantoms = simulation.phantom_poses()
        # Lanes 10 and 11 are the lines y = 0 and y = 3.5.
        assert phantoms.y_m[phantoms.mask] == pytest.approx(
            np.where(phantoms.mask, [0.0, 3.5], 0.0)[phantoms.mask]
        )
        for row in range(0, 100, 7):
            area = Polygon(simulation.visible_area(row)).buffer(0.05)
            for lane in np.flatnonzero(phantoms.mask[row]):
                assert area.covers(Point(phantoms.x_m[row, lane], phantoms.y_m[row, lane]))
            ids = set(found.vehicle_id[row, found.vehicle_mask[row]].tolist())
            real = set(true.vehicle_id[row, true.vehicle_mask[row]].tolist())
            shown = phantoms.mask[row]
            # Zones are 6 m long, lane 10 from west to east and lane 11 from east to west.
            coming = shown & (phantoms.x_m[row] * [1.0, -1.0] < 2.9)
            assert ids >= real | set(phantoms.id[row, coming].tolist())
            assert ids <= real | set(phantoms.id[row, shown].tolist())
        # The truth does not know of them.
        assert simulation.vehicle_poses().mask.shape == (100, 6)
        assert np.array_equal(true.lane_hidden_distance_m, found.lane_hidden_distance_m)
        for one in (plain, simulation):
            one.step([STOP] * 100)


def test_without_phantoms_there_are_none(crossing_model: IntersectionModel, busy: Scenario) -> None:
    assert looking(crossing_model, busy, 3, Sensor()).phantom_poses().mask.shape == (3, 0)
