# SPDX-License-Identifier: Apache-2.0
"""A training run from its description to its policy: builds the parts, evaluates, keeps the best.

Its whole state can be saved and taken over, so that an interrupted run ends in the same policy.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.state.encoding import StateConfig
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.batch import BatchEnvironment
from sim_bridge.environment.episodes import DrivenEpisodes, drive
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.place import Place
from sim_bridge.environment.rewards import reward_named
from sim_bridge.environment.seeds import VALIDATION_SEEDS, fixed_seeds
from sim_bridge.learning.config import TrainingConfig
from sim_bridge.learning.dense import Array
from sim_bridge.learning.greedy import GreedyPolicy
from sim_bridge.learning.learner import Learner
from sim_bridge.learning.trainer import Progress, Trainer
from sim_bridge.scenarios.loading import load_scenario
from sim_bridge.simulation.simulation import Simulation


@dataclass(frozen=True)
class Run:
    """What is trained: all that decides the result, but for the map's file."""

    config: TrainingConfig
    reward: str
    seed: int
    map_name: str
    scenario: str


@dataclass(frozen=True)
class Score:
    """How the greedy policy did on some episodes, as shares of them."""

    episodes: int
    success: float
    collision: float
    timeout: float
    mean_speed_mps: float

    @classmethod
    def of(cls, driven: DrivenEpisodes) -> "Score":
        """Return the score of driven episodes."""
        return cls(
            episodes=len(driven.seed),
            success=driven.share(Outcome.SUCCESS),
            collision=driven.share(Outcome.COLLISION),
            timeout=driven.share(Outcome.TIMEOUT),
            mean_speed_mps=driven.mean_speed_mps,
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


class Session:
    """Trains as a run describes and remembers the policy that did best on validation."""

    def __init__(self, run: Run, place: Place, initial_weights: Array) -> None:
        """Build simulator, environment and learner.

        Raises:
            ConfigurationError, ScenarioError: the run names something that does not exist.
        """
        self.run_description = run
        self.state_config = StateConfig()
        scenario = load_scenario(run.scenario)
        self.decision_period_s = scenario.timing.decision_period_s
        evaluation = run.config.evaluation
        environment = BatchEnvironment(
            simulation=place.simulation(scenario, run.config.environments),
            encoder=StateEncoder(self.state_config),
            reward=reward_named(run.reward),
            risk=RiskConfig(),
            run_seed=run.seed,
        )
        self._learner = Learner(run.config.learner, initial_weights)
        self._trainer = Trainer(run.config, environment, self._learner, run.seed)
        self._evaluation = place.simulation(scenario, evaluation.episodes)
        self._validation = place.simulation(scenario, evaluation.validation_episodes)
        self.records: list[Record] = []
        self.best: Best | None = None

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

    def _score(self, simulation: Simulation) -> Score:
        policy = GreedyPolicy(self._learner, StateEncoder(self.state_config))
        return Score.of(drive(simulation, policy, fixed_seeds(VALIDATION_SEEDS, simulation.batch)))

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
