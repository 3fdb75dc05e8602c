# SPDX-License-Identifier: Apache-2.0
"""The sound action whose best continuation gets to the goal first (ours).

The fastest sound action runs up to the conflict zone and waits there; from rest it then needs
longer gaps than it would at speed. This one looks a few seconds ahead, in traffic that keeps its
speed, and may wait further back, or creep forward to see more. Only the first action is carried
out, and that one is sound at present, whatever becomes of the prediction.
"""

import dataclasses
from dataclasses import dataclass, field

import numpy as np

from risk_dqn_planner.policies.base import Action, Decisions
from risk_dqn_planner.policies.fastest_sound import assumptions_of, sound_decisions, what_forbids
from risk_dqn_planner.policies.fingerprint import fingerprint
from risk_dqn_planner.policies.foresight.search import search_into
from risk_dqn_planner.policies.foresight.sight import SightLines
from risk_dqn_planner.policies.foresight.task import SearchNumbers, work_fit_for, work_for
from risk_dqn_planner.policies.rule_based import RuleBasedConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.situation.situations import Booleans, Situations
from risk_dqn_planner.vehicle import require_in_range


@dataclass(frozen=True)
class LookAheadConfig:
    """How far the search looks, and what it holds for dear."""

    decisions: int = field(
        default=8,
        metadata={"description": "Decisions that the search looks ahead",
                  "minimum": 1, "maximum": 40},
    )  # fmt: skip
    cell_m: float = field(
        default=0.5,
        metadata={"description": "States of the search closer than this, and about as fast, are "
                  "one [m]",
                  "minimum": 0.05, "maximum": 5.0},
    )  # fmt: skip
    cell_mps: float = field(
        default=0.5,
        metadata={"description": "States of the search are as fast as each other within this "
                  "[m/s]",
                  "minimum": 0.05, "maximum": 5.0},
    )  # fmt: skip
    switching_price_s: float = field(
        default=0.1,
        metadata={"description": "Time that a plan may lose to do without a change of action [s]",
                  "minimum": 0.0, "maximum": 10.0},
    )  # fmt: skip
    gap_price: float = field(
        default=3.0,
        metadata={"description": "Time expected to be lost for each second by which the ego needs "
                  "a longer gap than at full speed",
                  "minimum": 0.0, "maximum": 100.0},
    )  # fmt: skip
    chance_price_s: float = field(
        default=3.0,
        metadata={"description": "Time expected to be lost at each place where the ego may yet "
                  "have to wait [s]",
                  "minimum": 0.0, "maximum": 60.0},
    )  # fmt: skip
    haste: float = field(
        default=0.5,
        metadata={"description": "Time expected to be lost for each second before such a place, as "
                  "gaps close that are not taken",
                  "minimum": 0.0, "maximum": 10.0},
    )  # fmt: skip
    creeping_price_s_per_m: float = field(
        default=20.0,
        metadata={"description": "Time expected to be lost for each metre by which the ego comes "
                  "to rest short of a line behind which a corner hides a lane [s/m]",
                  "minimum": 0.0, "maximum": 1000.0},
    )  # fmt: skip
    fine_cells: int = field(
        default=10,
        metadata={"description": "Where decimetres decide what is seen, cells are shorter by this",
                  "minimum": 1, "maximum": 100},
    )  # fmt: skip
    nearest_corner_m: float = field(
        default=2.0,
        metadata={"description": "What hides a lane ends at least this far before its centreline "
                  "[m]",
                  "minimum": 0.0, "maximum": 20.0},
    )  # fmt: skip

    def __post_init__(self) -> None:
        require_in_range(self)

    def numbers(self) -> SearchNumbers:
        """Return the numbers that kernels read."""
        return SearchNumbers(
            self.decisions,
            self.cell_m,
            self.cell_mps,
            self.switching_price_s,
            self.gap_price,
            self.chance_price_s,
            self.haste,
            self.creeping_price_s_per_m,
            self.fine_cells,
        )


class LookAheadPolicy:
    """Of the sound actions the first one of the best plan; the guard is that of fastest_sound."""

    chooses_sound = True

    def __init__(
        self, assumptions: SafetyAssumptions | None = None, config: LookAheadConfig | None = None
    ) -> None:
        self.config = config or LookAheadConfig()
        self._guard = Guard(assumptions)
        self._sight = SightLines(self.config.nearest_corner_m)
        self._work = work_for(self.config.numbers(), self.assumptions.numbers(), 0, 0)
        self._hash = fingerprint(
            {"policy": self.name}
            | dataclasses.asdict(self.assumptions)
            | dataclasses.asdict(self.config)
        )

    @classmethod
    def from_config(cls, config: RuleBasedConfig) -> "LookAheadPolicy":
        """Take over the vehicles and the period of a configuration."""
        return cls(assumptions_of(config))

    @property
    def assumptions(self) -> SafetyAssumptions:
        """What its soundness rests on."""
        return self._guard.assumptions

    @property
    def name(self) -> str:
        """Name for logs and messages."""
        return "look_ahead"

    @property
    def hash(self) -> str:
        """SHA-256 of assumptions and configuration."""
        return self._hash

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:
        """Decide for each situation; what vindicates the decision is remembered."""
        check = self._guard.look(situations, restart)
        p, c = self.assumptions.numbers(), self.config.numbers()
        self._work = work_fit_for(self._work, c, p, situations)
        action = np.empty(len(restart), dtype=np.int64)
        critical = np.empty((len(restart), 2), dtype=np.int64)
        search_into(
            situations,
            p,
            c,
            self._guard.known,
            self._sight.corner_m(situations, restart),
            self._guard.sound(check),
            self._guard.in_force,
            self._work,
            action,
            critical,
        )
        self._guard.decided(check, action)
        vehicle, lane, lacking_s = what_forbids(check, np.minimum(action + 1, Action.FAST))
        # It could go faster, but keeps back.
        keeps = (lane < 0) & (action < Action.FAST)
        vehicle = np.where(keeps, critical[:, 0], vehicle)
        lane = np.where(keeps, critical[:, 1], lane)
        return sound_decisions(self._guard, check, action, vehicle, lane, lacking_s)
