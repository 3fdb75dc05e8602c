# SPDX-License-Identifier: Apache-2.0
"""A training run from its description to its policy: builds the parts, evaluates, keeps the best.

A run may take place on several maps and in several scenarios: their combinations are driven side
by side, each by its share of the environments and of the episodes of an evaluation.

Its whole state can be saved and taken over, so that an interrupted run ends in the same policy.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from risk_dqn_planner.policies.base import Policy
from risk_dqn_planner.policies.look_ahead import LookAheadConfig
from risk_dqn_planner.policies.outlook import Outlook, OutlookConfig
from risk_dqn_planner.policies.supervised import Supervisor
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.state.encoding import StateConfig
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.advisor import Advisor
from sim_bridge.environment.batch import BatchEnvironment
from sim_bridge.environment.episodes import DrivenEpisodes, drive
from sim_bridge.environment.interface import Environment, Outcome
from sim_bridge.environment.place import Place, Places
from sim_bridge.environment.rewards import reward_named
from sim_bridge.environment.seeds import VALIDATION_SEEDS, fixed_seeds
from sim_bridge.environment.side_by_side import SideBySide, shares_of
from sim_bridge.learning.config import AdviceConfig
from sim_bridge.learning.dense import Array
from sim_bridge.learning.greedy import GreedyPolicy
from sim_bridge.learning.learner import Learner
from sim_bridge.learning.run import Run
from sim_bridge.learning.trainer import Progress, Trainer
from sim_bridge.scenarios.loading import Scenario, load_scenario
from sim_bridge.simulation.simulation import Simulation


@dataclass(frozen=True)
class Score:
    """How the greedy policy did on some episodes, as shares of them."""

    episodes: int
    success: float
    collision: float
    timeout: float
    mean_speed_mps: float

    @classmethod
    def of(cls, parts: Sequence[DrivenEpisodes]) -> "Score":
        """Return the score of driven episodes, all parts together."""
        outcome = np.concatenate([part.outcome for part in parts])
        speed_mps = np.concatenate([part.statistics.mean_speed_mps for part in parts])
        return cls(
            episodes=len(outcome),
            success=float(np.mean(outcome == Outcome.SUCCESS)),
            collision=float(np.mean(outcome == Outcome.COLLISION)),
            timeout=float(np.mean(outcome == Outcome.TIMEOUT)),
            mean_speed_mps=float(speed_mps.mean()),
        )

    @property
    def rank(self) -> tuple[int, float]:
        """What the best policy has most of: a collision undoes a success; then speed decides."""
        return round((self.success - self.collision) * self.episodes), self.mean_speed_mps


@dataclass(frozen=True)
class Record:
    """One report of a run. training: episodes since the last one, with exploration.

    evaluation: the paper's 20 episodes; validation: the larger set, where it was driven.
    """

    steps: int
    episodes: int
    updates: int
    epsilon: float
    loss: float
    training_success: float
    evaluation: Score
    validation: Score | None


@dataclass(frozen=True)
class Best:
    """The policy with the highest rank on the validation episodes so far."""

    steps: int
    score: Score
    weights: Array


Course = tuple[Place, Scenario]


def _simulations(courses: Sequence[Course], count: int, memory: str) -> list[Simulation]:
    """Divide so many episodes among the courses."""
    return [
        place.simulation(scenario, share, memory)
        for (place, scenario), share in zip(courses, shares_of(count, len(courses)), strict=True)
    ]


class Session:
    """Trains as a run describes and remembers the policy that did best on validation."""

    def __init__(self, run: Run, places: Sequence[Places], initial_weights: Array) -> None:
        """Build simulators, environments and learner; places: the run's maps, in their order.

        Raises:
            ConfigurationError, ScenarioError: the run names something that does not exist, or
                has fewer environments or episodes than combinations of map and scenario.
        """
        self.run_description = run
        self.state_config = StateConfig()
        self.outlook_config = OutlookConfig()
        scenarios = [load_scenario(name) for name in run.scenarios]
        courses = [(place.of(scenario), scenario) for place in places for scenario in scenarios]
        self.decision_period_s = courses[0][1].timing.decision_period_s
        evaluation = run.config.evaluation
        environment = self._environment(courses)
        self._learner = Learner(run.config.learner, initial_weights)
        self._trainer = Trainer(run.config, environment, self._learner, run.seed)
        self._evaluation = _simulations(courses, evaluation.episodes, run.memory)
        self._validation = _simulations(courses, evaluation.validation_episodes, run.memory)
        self.records: list[Record] = []
        self.best: Best | None = None

    def _environment(self, courses: Sequence[Course]) -> Environment:
        run = self.run_description
        parts: list[BatchEnvironment] = []
        for simulation in _simulations(courses, run.config.environments, run.memory):
            advice = run.config.advice
            part = BatchEnvironment(
                simulation=simulation,
                encoder=StateEncoder(self.state_config),
                reward=reward_named(run.reward),
                risk=RiskConfig(),
                run_seed=run.seed,
                first=sum(part.batch for part in parts),
                guard=Guard(run.assumptions) if run.supervised and not self._looks else None,
                outlook=self._outlook(),
                advisor=None if advice is None else self._advisor(advice),
            )
            parts.append(part)
        return SideBySide(parts) if len(parts) > 1 else parts[0]

    @property
    def _looks(self) -> bool:
        """Whether the network is told more than the paper's state."""
        return self.run_description.config.outlook

    def _outlook(self) -> Outlook | None:
        run = self.run_description
        return Outlook(run.assumptions, self.outlook_config) if self._looks else None

    def _advisor(self, advice: AdviceConfig) -> Advisor:
        config = LookAheadConfig(switching_price_s=advice.switching_price_s)
        return Advisor(self.run_description.assumptions, config)

    @property
    def last_weights(self) -> Array:
        """The weights (P,) as they are now."""
        return self._learner.weights

    @property
    def progress(self) -> float:
        """Share of the run that is over."""
        return self._trainer.progress

    def run(self) -> Iterator[Record]:
        """Train to the end; yield a record after every so many episodes, and at the end."""
        for progress in self._trainer.run():
            record = self._evaluate(progress)
            self.records.append(record)
            yield record

    def _evaluate(self, progress: Progress) -> Record:
        config = self.run_description.config
        number = len(self.records) + 1
        over = progress.steps >= config.steps
        validate = over or number % config.evaluation.validation_every == 0
        validation = self._score(self._validation) if validate else None
        if validation and (self.best is None or validation.rank > self.best.score.rank):
            self.best = Best(progress.steps, validation, self._learner.weights.copy())
        ended = progress.ended[Outcome.SUCCESS :].sum()
        return Record(
            steps=progress.steps,
            episodes=progress.episodes,
            updates=progress.updates,
            epsilon=progress.epsilon,
            loss=progress.loss,
            training_success=float(progress.ended[Outcome.SUCCESS] / max(ended, 1)),
            evaluation=self._score(self._evaluation),
            validation=validation,
        )

    def policy(self) -> Policy:
        """Return the greedy policy, supervised as in the run; it goes on learning with the run."""
        run, encoder = self.run_description, StateEncoder(self.state_config)
        policy = GreedyPolicy(self._learner, encoder, self._outlook())
        supervised = run.supervised and not self._looks
        return Supervisor(policy, assumptions=run.assumptions) if supervised else policy

    def _score(self, simulations: Sequence[Simulation]) -> Score:
        policy = self.policy()
        seeds = fixed_seeds(VALIDATION_SEEDS, max(each.batch for each in simulations))
        return Score.of([drive(each, policy, seeds[: each.batch]) for each in simulations])

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically.

        Valid between two records of `run`.
        """
        return {
            "trainer": self._trainer.state_dict(),
            "records": list(self.records),
            "best": self.best,
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over an interrupted session of the same run."""
        self._trainer.load_state_dict(state["trainer"])
        self.records = list(state["records"])
        self.best = state["best"]
