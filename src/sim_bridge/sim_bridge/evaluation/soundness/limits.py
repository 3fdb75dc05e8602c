# SPDX-License-Identifier: Apache-2.0
"""What is possible at all, and what is with every step sound: contestants like any other.

The clairvoyant is exact where traffic does not react to the ego. Elsewhere, and for every sound
limit, the fastest way that a beam search finds stands in: a lower bound.
"""

import dataclasses

import numpy as np

from risk_dqn_planner.errors import ScenarioError
from risk_dqn_planner.policies.fingerprint import fingerprint
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.config import INSTANTANEOUS, TRACKED
from sim_bridge.environment.place import Place
from sim_bridge.environment.seeds import Seeds
from sim_bridge.evaluation.clairvoyant import NAME as CLAIRVOYANT
from sim_bridge.evaluation.clairvoyant import require_indifferent
from sim_bridge.evaluation.rollout import Clairvoyant, Driven
from sim_bridge.evaluation.soundness.beam import Beam, BeamConfig
from sim_bridge.simulation.simulation import Simulation

SOUND_LIMIT = "sound_limit"
# So many episodes are searched side by side.
_SIDE_BY_SIDE = 16


class SoundLimit:
    """The fastest way found on which every action is sound under some assumptions.

    Without assumptions nothing is checked: then it stands in for the clairvoyant.
    """

    training_seed = None

    def __init__(
        self, place: Place, assumptions: SafetyAssumptions | None, config: BeamConfig | None = None
    ) -> None:
        self._place, self._assumptions = place, assumptions
        self._config = config or BeamConfig()
        self.name = CLAIRVOYANT if assumptions is None else SOUND_LIMIT

    @property
    def hash(self) -> str:
        """SHA-256 of the assumptions and of how much is searched."""
        assumptions = self._assumptions
        checked = {} if assumptions is None else dataclasses.asdict(assumptions)
        return fingerprint({"policy": self.name} | dataclasses.asdict(self._config) | checked)

    def drive(self, simulation: Simulation, seeds: Seeds) -> Driven:
        """Search the episodes of the simulation's scenario, with the memory that it has."""
        memory = INSTANTANEOUS if simulation.tracker is None else TRACKED
        rows = self._config.width * min(_SIDE_BY_SIDE, len(seeds))
        narrow, wide = (
            self._place.simulation(simulation.scenario, batch, memory) for batch in (rows, 3 * rows)
        )
        beam = Beam(narrow, wide, self._assumptions, self._config)
        return Driven(beam.search(seeds), np.zeros(len(seeds), dtype=np.bool_))


class PhysicalLimit:
    """The clairvoyant where there is one, else the fastest way found without any check."""

    name = CLAIRVOYANT
    training_seed = None

    def __init__(self, place: Place, exact: Clairvoyant, config: BeamConfig | None = None) -> None:
        self._exact, self._found = exact, SoundLimit(place, None, config)

    @property
    def hash(self) -> str:
        """SHA-256 of both searches."""
        return fingerprint({"exact": self._exact.hash, "else": self._found.hash})

    def drive(self, simulation: Simulation, seeds: Seeds) -> Driven:
        """Search the episodes; those that are not proven optimal are marked so."""
        try:
            require_indifferent(simulation)
        except ScenarioError:
            return self._found.drive(simulation, seeds)
        return self._exact.drive(simulation, seeds)
