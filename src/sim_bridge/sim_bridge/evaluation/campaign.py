# SPDX-License-Identifier: Apache-2.0
"""All contestants in all cells on the same episodes, one result each."""

import hashlib
import platform
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

import numpy as np

from risk_dqn_planner.errors import ScenarioError
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from sim_bridge.environment.place import Place, Places
from sim_bridge.environment.seeds import TEST_SEEDS, fixed_seeds
from sim_bridge.evaluation.cells import Cell, what_is_drawn
from sim_bridge.evaluation.rollout import Clairvoyant, Contestant, joined, roll_out
from sim_bridge.evaluation.store import Store, sources_fingerprint
from sim_bridge.evaluation.summary import summarise, summarise_first
from sim_bridge.learning.checkpoint import git_revision
from sim_bridge.world.entries import entries_in_range

# Batches are no larger than memory and the wish to interrupt allow; results do not depend on it.
BATCH = 500

Advance = Callable[[int], None]


@dataclass(frozen=True)
class Campaign:
    """Where, on how many episodes of the test range, and where finished cells are kept.

    first: of how many of the first episodes to tell the outcomes one by one, `summarise_first`.
    assumptions: of whoever drives, where a cell has its own; the hash of a learned policy is that
    of its file, whatever it takes for granted.
    """

    places: Places
    episodes: int
    store: Store
    first: int = 0
    assumptions: SafetyAssumptions | None = None

    def result(self, driver: Contestant, cell: Cell, advance: Advance) -> dict[str, Any]:
        """Return one line of results.json, driving the episodes unless they were driven before.

        advance: told the number of episodes after each batch.

        Raises:
            ScenarioError: the cell cannot be laid out here, or has no optimum.
        """
        scenario = cell.load()
        place = self.places.of(scenario)
        work = {
            "policy": [driver.name, driver.hash],
            "scenario": what_is_drawn(scenario),
            "place": place_fingerprint(place),
            "memory": cell.memory,
            "episodes": self.episodes,
            "first": self.first,
            "assumptions": None if self.assumptions is None else asdict(self.assumptions),
            "sources": sources_fingerprint(),
        }
        figures = self.store.get(work)
        if figures is None:
            figures = self._drive(driver, place, cell, advance)
            self.store.put(work, figures)
        else:
            advance(self.episodes)
        return {
            "policy": driver.name,
            "policy_hash": driver.hash,
            "training_seed": driver.training_seed,
            "map": place.map_name,
            "scenario": scenario.name,
            "traffic": cell.traffic,
            "sensor_range_m": scenario.sensor.range_m,
            **figures,
        }

    def _drive(
        self, driver: Contestant, place: Place, cell: Cell, advance: Advance
    ) -> dict[str, Any]:
        seeds = fixed_seeds(TEST_SEEDS, self.episodes)
        simulation = place.simulation(cell.load(), min(BATCH, self.episodes), cell.memory)
        parts = []
        for part in roll_out(simulation, driver, seeds):
            parts.append(part)
            advance(len(part.optimal))
        driven = joined(parts)
        figures = summarise(driven)
        if self.first:
            figures["first"] = summarise_first(driven, self.first)
        if isinstance(driver, Clairvoyant):
            figures["proven_share"] = round(float(np.mean(driven.optimal)), 6)
        return figures


def place_fingerprint(place: Place) -> str:
    """Return a SHA-256 of an intersection with all that is built on it."""
    digest = hashlib.sha256(repr(place.model).encode())
    paths = [path.path for lane in place.model.lanes for path in lane.paths]
    lines = [path.centerline.xy for path in (place.model.ego_path, *paths)]
    for points in (*lines, *place.outlines):
        digest.update(np.ascontiguousarray(points).tobytes())
    return digest.hexdigest()


def has_optimum(driver: Contestant, places: Places, cell: Cell) -> str:
    """Return why a contestant cannot take part in a cell; empty if it can."""
    if not isinstance(driver, Clairvoyant):
        return ""
    try:
        scenario = cell.load()
        driver.drive(places.of(scenario).simulation(scenario, 1), fixed_seeds(TEST_SEEDS, 1))
    except ScenarioError as error:
        return str(error)
    return ""


def entries_in_sight(places: Places, cell: Cell) -> dict[str, dict[str, float]]:
    """Return `entries_in_range` of a cell [m], by map and lane; nothing where there are none.

    Raises:
        ScenarioError: the cell cannot be laid out here.
    """
    scenario = cell.load()
    place = places.of(scenario)
    found = entries_in_range(place.simulation(scenario, 1).world)
    lanes = {str(lane): round(way_m, 1) for lane, way_m in sorted(found.items())}
    return {place.map_name: lanes} if lanes else {}


def versions(place: Place, drivers: Sequence[Contestant]) -> dict[str, Any]:
    """Return what the results depend on; nothing in it changes from one run to the next."""
    return {
        "git_revision": git_revision(),
        "sources": sources_fingerprint(),
        "python": platform.python_version(),
        "numpy": version("numpy"),
        "numba": version("numba"),
        "map": place.map_name,
        "policies": list(dict.fromkeys(driver.name for driver in drivers)),
        "first_seed": TEST_SEEDS.start,
    }
