# SPDX-License-Identifier: Apache-2.0
"""B simulated episodes as a learning problem: perceive, encode, reward, begin the next episode."""

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.policies.base import Action
from risk_dqn_planner.policies.outlook import Outlook, Views
from risk_dqn_planner.risk.config import RiskConfig
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.safety.joint_check import JointCheck
from risk_dqn_planner.situation.situations import Booleans, Integers
from risk_dqn_planner.state.history import StateEncoder
from sim_bridge.environment.advisor import Advisor
from sim_bridge.environment.interface import EnvironmentStep, Outcome, States
from sim_bridge.environment.rewards import RewardConfig, rewards
from sim_bridge.environment.seeds import Seeds, training_seeds
from sim_bridge.simulation.simulation import Simulation, StepResult


def outcomes(result: StepResult) -> NDArray[np.int64]:
    """Return the Outcome (B,) of the episodes that this step ended, RUNNING for all others."""
    outcome = np.full(len(result.ran), Outcome.RUNNING, dtype=np.int64)
    outcome[result.reached_goal] = Outcome.SUCCESS
    outcome[result.collided] = Outcome.COLLISION
    outcome[result.timed_out] = Outcome.TIMEOUT
    outcome[~result.ran] = Outcome.RUNNING
    return outcome


class BatchEnvironment:
    """The simulator for training; implements `interface.Environment`.

    Episode seeds follow from (run_seed, index in the batch, count of episodes) and lie in the
    training range.
    """

    def __init__(
        self,
        simulation: Simulation,
        encoder: StateEncoder,
        reward: RewardConfig,
        risk: RiskConfig,
        run_seed: int,
        first: int = 0,
        guard: Guard | None = None,
        outlook: Outlook | None = None,
        advisor: Advisor | None = None,
    ) -> None:
        """Take a simulation.

        first: number of its first environment among all of the run. guard: tells which actions
        are sound on what is perceived; with none of them all are. outlook: in place of a guard,
        tells more, which follows the state in what `step` returns. advisor: for `advice`, which
        needs an outlook.
        """
        self._simulation = simulation
        self._encoder = encoder
        self._reward = reward
        self._risk = risk
        self._run_seed = run_seed
        self._first = first
        self._guard = guard
        self._check: JointCheck | None = None
        self._outlook = outlook
        self._views: Views | None = None
        self._advisor = advisor
        self._sound = np.ones((simulation.batch, len(Action)), dtype=np.bool_)
        self._begun = np.zeros(self.batch, dtype=np.int64)
        self._ended = np.zeros(self.batch, dtype=np.bool_)
        self._situations = simulation.situations()
        everywhere = np.ones(self.batch, dtype=np.bool_)
        self._states = encoder.encode(self._situations, everywhere)
        more = 0 if outlook is None else outlook.config.size
        self._told = np.empty((self.batch, self._states[0].size + more), dtype=np.float32)

    @property
    def batch(self) -> int:
        """B."""
        return self._simulation.batch

    @property
    def simulation(self) -> Simulation:
        """The simulation behind, to look at."""
        return self._simulation

    @property
    def features(self) -> int:
        """How many numbers a state has."""
        return int(self._told.shape[1])

    @property
    def sound(self) -> Booleans:
        """Which actions (B, 3) may be taken now: all of them without a guard."""
        return self._sound

    def advice(self) -> Integers:
        """Return what the adviser would do now (B,).

        Raises:
            ConfigurationError: there is nobody to ask, or no situation yet.
        """
        if self._advisor is None or self._views is None:
            raise ConfigurationError("advice needs an adviser, an outlook and a first situation")
        return self._advisor.best_actions(self._situations, self._views)

    def reset(self, seeds: Seeds | None = None) -> States:
        """Begin the next episode of each environment, or those of `seeds` (B,).

        Returns the flat states (B, F).
        """
        everywhere = np.ones(self.batch, dtype=np.bool_)
        self._begin(everywhere, seeds)
        self._ended[:] = False
        return self._perceive(everywhere)

    def step(self, actions: NDArray[np.int64]) -> EnvironmentStep:
        """Take one action (B,) in each environment, or begin the next episode where one ended."""
        begin = self._ended
        if self._guard is not None and self._check is not None:
            self._guard.decided(self._check, actions)
        if self._outlook is not None and self._views is not None:
            self._outlook.decided(self._views, actions)
        before = self._manners()
        result = self._simulation.step(actions)
        manners = [now > then for now, then in zip(self._manners(), before, strict=True)]
        outcome = outcomes(result)
        if begin.any():
            self._begin(begin)
        states = self._perceive(begin)
        reward = rewards(
            self._reward,
            self._risk,
            self._situations,
            outcome == Outcome.COLLISION,
            outcome == Outcome.SUCCESS,
            *manners,
        )
        self._ended = outcome != Outcome.RUNNING
        terminated = self._ended & (outcome != Outcome.TIMEOUT)
        return EnvironmentStep(
            taken=~begin,
            reward=reward,
            discount=1.0 - terminated.astype(np.float32),
            outcome=outcome,
            states=states,
        )

    def _begin(self, which: NDArray[np.bool_], seeds: Seeds | None = None) -> None:
        if seeds is None:
            seeds = training_seeds(self._run_seed, self._begun, self._first)
        self._simulation.reset(seeds, which)
        self._begun += which

    def _perceive(self, restart: NDArray[np.bool_]) -> States:
        self._simulation.situations(out=self._situations)
        self._encoder.encode(self._situations, restart, out=self._states)
        if self._guard is not None:
            self._check = self._guard.look(self._situations, restart)
            self._sound = self._guard.sound(self._check)
        states = self._states.reshape(self.batch, -1)
        if self._outlook is None:
            return states
        self._views = self._outlook.look(self._situations, restart)
        self._sound = self._views.sound
        np.concatenate((states, self._views.inputs), axis=1, out=self._told)
        return self._told

    def _manners(self) -> list[NDArray[np.int64]]:
        """Return how often (B,) each ego has changed its action and braked hard, if it counts."""
        if not self._reward.prices_manners:
            return []
        counts = self._simulation.state.counts
        return [counts.action_changes.copy(), counts.hard_brakes.copy()]

    def state_dict(self) -> dict[str, Any]:
        """Return everything that `load_state_dict` needs to go on identically."""
        return {
            "simulation": copy.deepcopy(self._simulation.state),
            "lags": copy.deepcopy(self._simulation.lags),
            "hidden_space": copy.deepcopy(self._simulation.hidden_space),
            "encoder": copy.deepcopy(self._encoder),
            "begun": self._begun.copy(),
            "ended": self._ended.copy(),
            "guard": copy.deepcopy((self._guard, self._check, self._sound)),
            "outlook": copy.deepcopy((self._outlook, self._views, self._situations)),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Take over an interrupted run of the same scenario, map and batch."""
        self._simulation.state = copy.deepcopy(state["simulation"])
        # Runs from before there was a memory, or a lag, have none.
        self._simulation.lags = copy.deepcopy(state.get("lags", self._simulation.lags))
        self._simulation.hidden_space = copy.deepcopy(state.get("hidden_space"))
        self._encoder = copy.deepcopy(state["encoder"])
        self._begun[:] = state["begun"]
        self._ended = state["ended"].copy()
        # Nor a guard.
        if "guard" in state:
            self._guard, self._check, self._sound = copy.deepcopy(state["guard"])
        if "outlook" in state:
            self._outlook, self._views, self._situations = copy.deepcopy(state["outlook"])
