# SPDX-License-Identifier: Apache-2.0
"""Other people's simulators as contestants: each takes one decision after the other."""

import random
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import gymnasium

from bench import sumo_net

VEHICLES = 8
STEP_S, STEPS_A_DECISION = 0.1, 5
SPEEDS_MPS = (0.0, 1.0, 5.0)
EGO = "ego"
EGO_ROUTE = "r31"
# SUMO's vehicles then obey no one but the speed they are given.
NO_CHECKS = 0


class HighwayEnv:
    """highway-env's intersection, two decisions a second, nothing drawn, random actions."""

    def __init__(self) -> None:
        """Raises ImportError where highway-env is not installed."""
        import highway_env  # noqa: F401, PLC0415 (a peer, may be missing)

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._env = gymnasium.make("intersection-v0", config={"policy_frequency": 2})
        self._env.reset(seed=0)
        self._env.action_space.seed(0)

    def decide(self) -> None:
        """Take one decision step; begin the next episode where one ended."""
        *_, terminated, truncated, _ = self._env.step(self._env.action_space.sample())
        if terminated or truncated:
            self._env.reset()


class SumoCrossing:
    """A crossing in libsumo, kept at VEHICLES other vehicles; the ego goes straight on."""

    def __init__(self, folder: Path) -> None:
        """Raises ImportError where libsumo is not installed."""
        with warnings.catch_warnings():
            # It misses SUMO's data, which are of no use here.
            warnings.simplefilter("ignore")
            import libsumo  # noqa: PLC0415 (a peer, may be missing)

        (folder / "crossing.net.xml").write_text(sumo_net.network(), encoding="utf-8")
        (folder / "crossing.rou.xml").write_text(sumo_net.routes(), encoding="utf-8")
        self._sumo = libsumo
        self._random = random.Random(0)  # noqa: S311 (traffic, no secret)
        self._others = [f"r{a}{b}" for a, b in sumo_net.MOVEMENTS if a != int(EGO_ROUTE[1])]
        self._added = 0
        self.decisions = 0
        self.observed = 0
        files = ["-n", str(folder / "crossing.net.xml"), "-r", str(folder / "crossing.rou.xml")]
        options = {
            "--step-length": str(STEP_S),
            "--collision.action": "none",
            "--time-to-teleport": "-1",
            "--xml-validation": "never",
            "--no-step-log": "true",
            "--no-warnings": "true",
            "--seed": "1",
        }
        libsumo.start(["sumo", *files, *(word for pair in options.items() for word in pair)])

    def decide(self) -> None:
        """Set the ego's speed, simulate half a second, and read what the others do."""
        vehicle = self._sumo.vehicle
        here = vehicle.getIDList()
        if EGO in here:
            vehicle.setSpeed(EGO, self._random.choice(SPEEDS_MPS))
        self._top_up(len(here) - (EGO in here), EGO in here)
        for _ in range(STEPS_A_DECISION):
            self._sumo.simulationStep()
        for name in vehicle.getIDList():
            vehicle.getPosition(name)
            vehicle.getSpeed(name)
            vehicle.getLaneID(name)
            self.observed += name != EGO
        self.decisions += 1

    def _top_up(self, others: int, ego_is_here: bool) -> None:
        """Send a new vehicle where one is missing and none waits for room already."""
        if self._sumo.simulation.getPendingVehicles():
            return
        if not ego_is_here:
            self._sumo.vehicle.add(EGO, EGO_ROUTE, typeID="car")
            self._sumo.vehicle.setSpeedMode(EGO, NO_CHECKS)
        if others < VEHICLES:
            self._added += 1
            route = self._random.choice(self._others)
            self._sumo.vehicle.add(f"v{self._added}", route, typeID="car", departSpeed="max")

    def close(self) -> None:
        """End the simulation; libsumo has one a process."""
        self._sumo.close()


@contextmanager
def sumo_crossing() -> Iterator[SumoCrossing]:
    """Run a SumoCrossing on files of its own."""
    with tempfile.TemporaryDirectory() as folder:
        crossing = SumoCrossing(Path(folder))
        try:
            yield crossing
        finally:
            crossing.close()
