# SPDX-License-Identifier: Apache-2.0
"""What is evaluated: the situations of the paper's figures, each with two kinds of traffic.

The paper does not say whether a vehicle that has left comes again. It matters more than
most of what it does say, so both are evaluated.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from risk_dqn_planner.situation.config import INSTANTANEOUS
from sim_bridge.scenarios.loading import Scenario, load_scenario

RESPAWNING, FINITE = "respawning", "finite"
TRAFFIC = (RESPAWNING, FINITE)
BASE = "base"
# The paper's four groups of challenging scenarios, and the ranges of its last figure.
CHALLENGES = ("dense_traffic", "severe_occlusion", "sensor_noise", "short_sensor_range")
RANGES_M = (40.0, 60.0, 90.0)


@dataclass(frozen=True)
class Cell:
    """One distribution of episodes, and how its ego perceives them.

    scenario: name or file; sensor_range_m, sensor_forward_m, brakes_for_ego_after_s: None as it
    says. memory: see SituationConfig.
    """

    scenario: str
    traffic: str
    sensor_range_m: float | None = None
    sensor_forward_m: float | None = None
    memory: str = INSTANTANEOUS
    brakes_for_ego_after_s: float | None = None

    def load(self) -> Scenario:
        """Return the scenario of this cell.

        Raises:
            ScenarioError: there is none of that name.
        """
        scenario = load_scenario(self.scenario)
        sensor = scenario.sensor
        if self.sensor_range_m is not None:
            sensor = replace(sensor, range_m=self.sensor_range_m)
        if self.sensor_forward_m is not None:
            sensor = replace(sensor, forward_offset_m=self.sensor_forward_m)
        scenario = replace(scenario, sensor=sensor)
        traffic = replace(scenario.traffic, respawn=self.traffic == RESPAWNING)
        if self.brakes_for_ego_after_s is not None:
            traffic = replace(traffic, brakes_for_ego_after_s=self.brakes_for_ego_after_s)
        return replace(scenario, traffic=traffic)


def paper_cells() -> list[Cell]:
    """Return the cells of the paper's figures, with both kinds of traffic."""
    return [
        cell
        for traffic in TRAFFIC
        for cell in (
            *(Cell(scenario, traffic) for scenario in (BASE, *CHALLENGES)),
            *(Cell(BASE, traffic, range_m) for range_m in RANGES_M),
        )
    ]


def cells_of(scenarios: Sequence[str]) -> list[Cell]:
    """Return the cells of the user's own choice of scenarios, names or files."""
    return [Cell(scenario, traffic) for traffic in TRAFFIC for scenario in scenarios]


def what_is_drawn(scenario: Scenario) -> dict[str, Any]:
    """Return all of a scenario that decides its episodes: not what it is called."""
    values = asdict(scenario)
    del values["name"], values["description"]
    return values
