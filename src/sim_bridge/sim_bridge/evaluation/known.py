# SPDX-License-Identifier: Apache-2.0
"""Optima that were found before, for episodes that are the same as far as the optimum can tell.

The clairvoyant perceives nothing: a scenario that differs only in what the ego sees has the same
optima, and so has one whose traffic differs only after the arrival or far from the ego's path.
"""

import hashlib
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.situation.situations import Integers
from sim_bridge.simulation.simulation import Simulation
from sim_bridge.simulation.state import Vehicles


class Optimum(NamedTuple):
    """The fastest way through one episode.

    steps, at_least: as in `Optima`. actions (D,). looked: the search read the film's first so
    many inner steps and none behind them, so that what comes later makes no difference.
    """

    steps: int
    at_least: int
    actions: Integers
    looked: int


class _Remembered(NamedTuple):
    traffic: bytes
    optimum: Optimum


def surroundings(simulation: Simulation) -> bytes:
    """Return a digest of all but start and traffic that decides an optimum."""
    world, settings = simulation.world, simulation.settings
    digest = hashlib.sha256()
    for table in (world.ego.table, world.paths.table):
        digest.update(np.ascontiguousarray(table).tobytes())
    digest.update(world.paths.contact_low_m.tobytes() + world.paths.contact_high_m.tobytes())
    numbers = (
        world.ego.goal_m, world.ego.contact_low_m, world.ego.contact_high_m,
        world.ego.length_m, world.ego.width_m,
        world.paths.vehicle_length_m, world.paths.vehicle_width_m,
        settings.step_s, settings.decision_steps, settings.limit_steps, *settings.ego,
    )  # fmt: skip
    digest.update(repr(numbers).encode())
    return digest.digest()


def within_contact(
    film: Vehicles, low_m: NDArray[np.float64], high_m: NDArray[np.float64]
) -> bytes:
    """Return the part of a film (T, N) that the ego could touch, ready to be compared.

    low_m, high_m (P,): where vehicles on a path can touch the ego, as in `Paths`.
    """
    near = film.driving & (film.s_m >= low_m[film.path]) & (film.s_m <= high_m[film.path])
    path, s_m = np.where(near, film.path, -1), np.where(near, film.s_m, 0.0)
    return hashlib.sha256(path.tobytes() + s_m.tobytes()).digest()


class KnownOptima:
    """Remembers optima by where their episodes take place and start."""

    def __init__(self) -> None:
        self._found: dict[tuple[bytes, float, float], list[_Remembered]] = {}

    def get(
        self, place: bytes, start: tuple[float, float], simulation: Simulation, film: Vehicles
    ) -> Optimum | None:
        """Return the optimum of an equal episode, None if none is known.

        place: `surroundings`. start: the ego's arc length and speed. film (T, N).
        """
        for known in self._found.get((place, *start), ()):
            if self._traffic(simulation, film, known.optimum.looked) == known.traffic:
                return known.optimum
        return None

    def put(
        self,
        place: bytes,
        start: tuple[float, float],
        simulation: Simulation,
        film: Vehicles,
        optimum: Optimum,
    ) -> None:
        """Remember the optimum of an episode."""
        traffic = self._traffic(simulation, film, optimum.looked)
        self._found.setdefault((place, *start), []).append(_Remembered(traffic, optimum))

    def _traffic(self, simulation: Simulation, film: Vehicles, looked: int) -> bytes:
        paths = simulation.world.paths
        head = film._replace(
            driving=film.driving[:looked], path=film.path[:looked], s_m=film.s_m[:looked]
        )
        return within_contact(head, paths.contact_low_m, paths.contact_high_m)
