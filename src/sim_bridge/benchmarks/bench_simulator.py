# SPDX-License-Identifier: Apache-2.0
"""Decision steps a second of the batched simulator on one core, and what they are spent on.

Run as `python benchmarks/bench_simulator.py [--map NAME] [--curves] [--json FILE]
[--picture FILE]`. Random actions on the scenario `base` with a fixed number of vehicles; ended
episodes are replaced at once, which is counted. The first round, which compiles, is not.
Processor time is measured, and the median and the best of the rounds given: on a busy computer the
best is nearer to what the code costs.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from risk_dqn_planner.risk.risk import RiskConfig, assess
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.place import Place, load_place
from sim_bridge.maps import map_names
from sim_bridge.scenarios.fields import Interval
from sim_bridge.scenarios.loading import load_scenario

PARTS = ("step", "situations", "risk", "encoding", "reset")
ROUNDS, STEPS = 10, 60
# The map with the most lanes, to show what each of them costs.
LANES_MAP = "multi_lane"


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
    return f"{name:<36}{parts}{cost.median:>10.0f}{cost.best:>8.0f}{cost.steps_per_s:>14,.0f}"


class Case(NamedTuple):
    """One load on a map, of which the first `lanes` intersecting lanes are taken."""

    map: str
    lanes: int
    load: Load
    cost: Cost

    def figures(self) -> dict[str, Any]:
        """Return the case as it is written to a file."""
        cost = self.cost
        known = {"map": self.map, "lanes": self.lanes, **self.load._asdict()}
        return {**known, **cost._asdict(), "steps_per_s": cost.steps_per_s}


def measured(map_name: str, load: Load, lanes: int | None = None) -> Case:
    """Measure a load and print its row of the table; `lanes`: that many of the map's only."""
    place = load_place(map_name)
    place = replace(place, model=replace(place.model, lanes=place.model.lanes[:lanes]))
    case = Case(map_name, len(place.model.lanes), load, cost_of(place, load))
    name = f"{map_name} {case.lanes} lanes, {load.vehicles} veh., batch {load.batch}"
    sys.stdout.write(line(name, case.cost) + "\n")
    sys.stdout.flush()
    return case


def curves(map_name: str) -> Iterator[Case]:
    """Measure by vehicles, by maps, by lanes of one map, and by batch."""
    yield from (measured(map_name, Load(vehicles=count)) for count in (0, 2, 4, 16, 24, 32))
    yield from (measured(name, Load()) for name in map_names() if name != map_name)
    most = len(load_place(LANES_MAP).model.lanes)
    yield from (measured(LANES_MAP, Load(), lanes) for lanes in range(1, most))
    yield from (measured(map_name, Load(batch=batch)) for batch in (1, 16, 128, 4096))


def draw_curves(cases: Sequence[Case], file: Path) -> None:
    """Draw the cost by vehicles on the first case's map, and by lanes of one map."""
    first = cases[0]
    usual = [case for case in cases if case.load.batch == first.load.batch]
    by_vehicles = [c for c in usual if c.map == first.map and c.lanes == first.lanes]
    by_lanes = [c for c in usual if c.map == LANES_MAP and c.load == first.load]
    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw_curve(left, [case.load.vehicles for case in by_vehicles], by_vehicles, "vehicle")
    left.set_title(f"{first.map}, {first.lanes} lanes")
    draw_curve(right, [case.lanes for case in by_lanes], by_lanes, "lane")
    right.set_title(f"The first lanes of {LANES_MAP}, {first.load.vehicles} vehicles")
    figure.suptitle(f"One core, batch of {first.load.batch}")
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=120)


def draw_curve(axes: Axes, at: Sequence[int], cases: Sequence[Case], unit: str) -> None:
    """Draw the median cost of cases at their number of units, with the straight line through."""
    cost = np.array([case.cost.median for case in cases]) * 1e-3
    axes.plot(at, cost, "o", label="measured, median of rounds")
    if len(set(at)) > 1:
        slope, start = np.polyfit(at, cost, 1)
        ends = np.array([0, max(at)])
        axes.plot(ends, start + slope * ends, label=f"{start:.2f} + {slope:.3f} per {unit}")
    axes.set(xlabel=f"{unit}s", ylabel="microseconds a decision step", xlim=(0, None))
    axes.set_ylim(0, None)
    axes.grid(visible=True, alpha=0.3)
    axes.legend()


def main() -> None:
    """Print a table of nanoseconds a decision step."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--map", default="four_way", choices=map_names(), dest="map_name")
    parser.add_argument("--curves", action="store_true", help="also by vehicles, maps and batch")
    parser.add_argument("--json", type=Path, help="write the figures to this file")
    parser.add_argument("--picture", type=Path, help="draw the curves to this file")
    options = parser.parse_args()
    if options.picture and not options.curves:
        parser.error("--picture draws what --curves measures; give both")
    heads = "".join(f"{part:>12}" for part in PARTS)
    sys.stdout.write(f"{'ns a decision step':<36}{heads}{'median':>10}{'best':>8}{'steps/s':>14}\n")
    cases = [measured(options.map_name, Load())]
    if options.curves:
        cases += curves(options.map_name)
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps([case.figures() for case in cases], indent=2)
        options.json.write_text(text + "\n", encoding="utf-8")
    if options.picture:
        draw_curves(cases, options.picture)


if __name__ == "__main__":
    main()
