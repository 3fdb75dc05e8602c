# SPDX-License-Identifier: Apache-2.0
"""The training loop: act, remember, learn. It yields; what evaluates, logs or saves is outside.

Its whole state is in `state_dict`, and nothing in it depends on the clock, so a run that was
interrupted at any yield goes on to the identical result.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.policies.base import Action
from sim_bridge.environment.interface import Environment, Outcome
from sim_bridge.learning.advice import Advice, AdviceMemory
from sim_bridge.learning.config import AdviceConfig, TrainingConfig
from sim_bridge.learning.learner import Learner
from sim_bridge.learning.n_step import NStepReturns
from sim_bridge.learning.replay import PrioritizedReplay, Transitions


class Progress(NamedTuple):
    """Where a run stands, and what happened since the last report.

    steps, episodes, updates: since the beginning. ended (4,): training episodes since the last
    report by Outcome, of which RUNNING means nothing. loss: mean over the updates since then,
    NaN if there were none.
    """

    steps: int
    episodes: int
    updates: int
    epsilon: float
    ended: NDArray[np.int64]
    loss: float


class Trainer:
    """One run of the algorithm on one environment; `seed` decides every random number of it."""

    def __init__(
        self, config: TrainingConfig, environment: Environment, learner: Learner, seed: int
    ) -> None:
        self._config = config
        self._environment = environment
        self._learner = learner
        self._replay = PrioritizedReplay(config.replay, environment.features, seed)
        self._returns = NStepReturns(
            environment.batch, config.n_step, config.gamma, environment.features
        )
        self._advice: AdviceMemory | None = None
        if config.advice is not None:
            self._advice = AdviceMemory(config.advice, environment.features, seed)
        self._random = np.random.default_rng([seed, 1])
        self._states = environment.reset().copy()
        self._sound = environment.sound.copy()
        # Where an episode has ended there is nothing to choose.
        self._over = np.zeros(environment.batch, dtype=np.bool_)
        # Where the last action was a random one, and which.
        self._explored = np.zeros(environment.batch, dtype=np.bool_)
        self._drawn = np.zeros(environment.batch, dtype=np.int64)
        self._steps = 0
        self._episodes = 0
        self._updates = 0
        self._reports = 0
        self._restart_report()

    @property
    def learner(self) -> Learner:
        """The learner, whose network is the policy so far."""
        return self._learner

    @property
    def progress(self) -> float:
        """Share of the run that is over, in [0, 1]."""
        return min(self._steps / self._config.steps, 1.0)

    def run(self) -> Iterator[Progress]:
        """Train to the end; yield after every so many episodes, and at the end."""
        every = self._config.evaluation.every_episodes
        while self._steps < self._config.steps:
            self._advance()
            over = self._steps >= self._config.steps
            if over or self._episodes // every > self._reports:
                self._reports = self._episodes // every
                yield self._report()

    def _advance(self) -> None:
        """Make one step in every environment and the updates that belong to it."""
        actions = self._choose_actions()
        step = self._environment.step(actions)
        ended = step.outcome != Outcome.RUNNING
        sound = self._environment.sound
        single = Transitions(self._states, actions, step.reward, step.discount, step.states, sound)
        self._replay.add(self._returns.push(single, step.taken, ended))
        self._states[:] = step.states
        self._sound[:] = sound
        self._over[:] = ended
        taken = int(step.taken.sum())
        self._steps += taken
        self._ended += np.bincount(step.outcome, minlength=len(Outcome))
        self._episodes += int(ended.sum())
        if taken and len(self._replay) >= self._config.warmup_steps:
            for _ in range(self._config.updates_per_step):
                self._learn()

    def _choose_actions(self) -> NDArray[np.int64]:
        """Choose epsilon-greedily for each environment, among the sound actions alone."""
        batch = self._environment.batch
        explore = self._random.random(batch) < self._config.exploration.epsilon(self.progress)
        if self._config.advice is not None:
            return self._choose_advised(self._config.advice, explore)
        actions = self._any_actions()
        if self._config.exploration.repeat > 0.0:
            actions, explore = self._repeated(actions, explore)
        if explore.all():
            return actions
        values = self._learner.q_values(self._states)
        greedy = np.where(self._sound, values, -np.inf).argmax(axis=1)
        return np.where(explore, actions, greedy)

    def _choose_advised(
        self, config: AdviceConfig, explore: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """Ask the expert, remember the answers, and choose; at first it often drives itself."""
        progress, batch = self.progress, self._environment.batch
        greedy = np.where(self._sound, self._learner.q_values(self._states), -np.inf).argmax(axis=1)
        if self._advice is not None and progress <= config.share:
            advised = self._environment.advice()
            asked = (self._sound.sum(axis=1) > 1) & ~self._over
            self._advice.add(Advice(self._states[asked], self._sound[asked], advised[asked]))
            driving = self._random.random(batch) < config.driving(progress)
            greedy = np.where(driving, advised, greedy)
        return np.where(explore, self._any_actions(), greedy)

    def _any_actions(self) -> NDArray[np.int64]:
        """Draw a sound action for each environment, all of them with equal chances."""
        batch = self._environment.batch
        actions = self._random.integers(0, len(Action), batch)
        while not (sound := self._sound[np.arange(batch), actions]).all():
            actions = np.where(sound, actions, self._random.integers(0, len(Action), batch))
        return actions

    def _repeated(
        self, actions: NDArray[np.int64], explore: NDArray[np.bool_]
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Let some random actions be those of the step before, where they still are sound."""
        batch = self._environment.batch
        again = self._explored & (self._random.random(batch) < self._config.exploration.repeat)
        again &= self._sound[np.arange(batch), self._drawn]
        self._drawn = np.where(again, self._drawn, actions)
        self._explored = explore | again
        return self._drawn, self._explored

    def _learn(self) -> None:
        advice = self._config.advice
        if advice is None or not advice.alone:
            self._learn_from_rewards()
        if self._advice is not None and advice is not None and len(self._advice):
            weight = advice.weight_at(self.progress)
            if weight > 0.0:
                drawn = self._advice.sample()
                self._learner.follow(drawn, weight, advice.temperature, self.progress)
        self._updates += 1

    def _learn_from_rewards(self) -> None:
        drawn = self._replay.sample(
            self._config.batch_size, self._config.replay.beta(self.progress)
        )
        errors, loss = self._learner.update(drawn, self.progress)
        self._replay.update_priorities(drawn.indices, errors)
        self._loss_sum += loss
        self._loss_count += 1

    def _report(self) -> Progress:
        report = Progress(
            steps=self._steps,
            episodes=self._episodes,
            updates=self._updates,
            epsilon=self._config.exploration.epsilon(self.progress),
            ended=self._ended,
            loss=self._loss_sum / self._loss_count if self._loss_count else float("nan"),
        )
        self._restart_report()
        return report

    def _restart_report(self) -> None:
        self._ended = np.zeros(len(Outcome), dtype=np.int64)
        self._loss_sum = 0.0
        self._loss_count = 0

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically.

        Valid between two reports of `run`.
        """
        return {
            "learner": self._learner.state_dict(),
            "replay": self._replay.state_dict(),
            "returns": self._returns.state_dict(),
            "environment": self._environment.state_dict(),
            "random": self._random.bit_generator.state,
            "states": self._states.copy(),
            "sound": self._sound.copy(),
            "random_actions": (self._explored.copy(), self._drawn.copy()),
            "advice": None if self._advice is None else self._advice.state_dict(),
            "over": self._over.copy(),
            "counts": (self._steps, self._episodes, self._updates, self._reports),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over an interrupted run of the same configuration."""
        self._learner.load_state_dict(state["learner"])
        self._replay.load_state_dict(state["replay"])
        self._returns.load_state_dict(state["returns"])
        self._environment.load_state_dict(state["environment"])
        self._random.bit_generator.state = state["random"]
        self._states[:] = state["states"]
        # Runs from before actions were ruled out know no other than sound ones.
        self._sound[:] = state.get("sound", True)
        if "random_actions" in state:
            self._explored, self._drawn = (array.copy() for array in state["random_actions"])
        # Nor any advice.
        if self._advice is not None:
            self._advice.load_state_dict(state["advice"])
        self._over[:] = state.get("over", False)
        self._steps, self._episodes, self._updates, self._reports = state["counts"]
        self._restart_report()
