# SPDX-License-Identifier: Apache-2.0
"""Decision steps a second of the batched simulator on one core, and what they are spent on.

Run as `python benchmarks/bench_simulator.py [--map NAME] [--curves] [--json FILE]`. Random actions
on the scenario `base` with a fixed number of vehicles; ended episodes are replaced at once, which
is counted. The first round, which compiles, is not. Processor time is measured, and the median and
the best of the rounds given: on a busy computer the best is nearer to what the code costs.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.risk.risk import RiskConfig, assess
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.place import Place, load_place
from sim_bridge.maps import map_names
from sim_bridge.scenarios.fields import Interval
from sim_bridge.scenarios.loading import load_scenario

PARTS = ("step", "situations", "risk", "encoding", "reset")
ROUNDS, STEPS = 10, 60


class Load(NamedTuple):
    """What is simulated: episodes side by side, and other vehicles in each."""

    batch: int = 1024
    vehicles: int = 8


class Cost(NamedTuple):
    """Nanoseconds a decision step: of each of PARTS in the median round, and in total."""

    parts: dict[str, float]
    median: float
    best: float

    @property
    def steps_per_s(self) -> float:
        """Decision steps a second in the median round."""
        return 1e9 / self.median


class Clock:
    """Adds up the time spent on each part."""

    def __init__(self) -> None:
        self.spent_s = dict.fromkeys(PARTS, 0.0)

    @contextmanager
    def on(self, part: str) -> Iterator[None]:
        """Count what happens inside as time spent on a part."""
        begin = time.process_time()
        yield
        self.spent_s[part] += time.process_time() - begin


class Course:
    """One simulation that goes on and on under random actions."""

    def __init__(self, place: Place, load: Load) -> None:
        base = load_scenario("base")
        count = Interval(load.vehicles, load.vehicles)
        scenario = replace(base, traffic=replace(base.traffic, vehicles=count))
        self._batch = load.batch
        self._random = np.random.default_rng(0)
        self._risk = RiskConfig()
        self._simulation = place.simulation(scenario, load.batch)
        self._encoder = StateEncoder()
        self._next_seed = 0
        self._ended = np.ones(load.batch, dtype=np.bool_)
        self._begin_episodes()
        self._situations = self._simulation.situations()
        self._states = self._encoder.encode(self._situations, self._ended)

    def _begin_episodes(self) -> None:
        seeds = np.arange(self._next_seed, self._next_seed + self._batch)
        self._next_seed += self._batch
        self._simulation.reset(seeds, self._ended)

    def drive(self) -> dict[str, float]:
        """Drive a round; return the nanoseconds a decision step that each part took."""
        clock = Clock()
        for _ in range(STEPS):
            actions = self._random.integers(0, 3, self._batch)
            restart: NDArray[np.bool_] = self._ended
            with clock.on("reset"):
                if restart.any():
                    self._begin_episodes()
            with clock.on("step"):
                result = self._simulation.step(actions)
            with clock.on("situations"):
                self._simulation.situations(out=self._situations)
            with clock.on("risk"):
                assess(self._situations, self._risk, include_hidden=False)
            with clock.on("encoding"):
                self._encoder.encode(self._situations, restart, self._states)
            self._ended = result.terminated | result.truncated
        return {part: s / (STEPS * self._batch) * 1e9 for part, s in clock.spent_s.items()}


def cost_of(place: Place, load: Load) -> Cost:
    """Measure one load."""
    course = Course(place, load)
    course.drive()
    rounds = sorted((course.drive() for _ in range(ROUNDS)), key=lambda parts: sum(parts.values()))
    parts = rounds[len(rounds) // 2]
    return Cost(parts, sum(parts.values()), sum(rounds[0].values()))


def line(name: str, cost: Cost) -> str:
    """Return a row of the table."""
    parts = "".join(f"{cost.parts[part]:>12.0f}" for part in PARTS)
    return f"{name:<28}{parts}{cost.median:>10.0f}{cost.best:>8.0f}{cost.steps_per_s:>14,.0f}"


def main() -> None:
    """Print a table of nanoseconds a decision step."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--map", default="four_way", choices=map_names(), dest="map_name")
    parser.add_argument("--curves", action="store_true", help="also by vehicles, maps and batch")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    options = parser.parse_args()
    cases = [(options.map_name, Load())]
    if options.curves:
        cases += [(options.map_name, Load(vehicles=count)) for count in (0, 2, 4, 16, 32)]
        cases += [(name, Load()) for name in map_names() if name != options.map_name]
        cases += [(options.map_name, Load(batch=batch)) for batch in (1, 16, 128, 4096)]
    heads = "".join(f"{part:>12}" for part in PARTS)
    sys.stdout.write(f"{'ns a decision step':<28}{heads}{'median':>10}{'best':>8}{'steps/s':>14}\n")
    figures = []
    for map_name, load in cases:
        place = load_place(map_name)
        cost = cost_of(place, load)
        lanes = len(place.model.lanes)
        name = f"{map_name}, {load.vehicles} veh., batch {load.batch}"
        sys.stdout.write(line(name, cost) + "\n")
        case = {"map": map_name, "lanes": lanes, **load._asdict(), **cost._asdict()}
        figures.append({**case, "steps_per_s": cost.steps_per_s})
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
