# SPDX-License-Identifier: Apache-2.0
"""The exact optimum of an episode with everything known: what no policy can beat.

It exists where traffic does not react to the ego: then the episode's traffic is one film, and
the fastest way to the goal a shortest path through it. The ego's three actions reach a finite
set of states, so nothing is discretised; see search.py.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.errors import ScenarioError
from risk_dqn_planner.policies.base import Action, Decisions, Reason, bare_decisions
from risk_dqn_planner.policies.fingerprint import fingerprint
from risk_dqn_planner.situation.situations import Booleans, Integers, Situations
from sim_bridge.environment.seeds import Seeds
from sim_bridge.evaluation.bounds import Bounds, Rules, lower_bounds, no_bounds, speeds_from
from sim_bridge.evaluation.known import KnownOptima, Optimum, surroundings
from sim_bridge.evaluation.search import GAVE_UP, IMPOSSIBLE, fastest_way
from sim_bridge.simulation.simulation import Simulation
from sim_bridge.simulation.state import Vehicles

NAME = "clairvoyant"

# Equal states differ by rounding only.
_SAME_M = 1e-6
# A first try without knowledge of the traffic solves most episodes.
_EASY_STATES = 20_000
# Else states within this are taken for one, which gives a way that is good but perhaps not best.
_COARSE_M = 0.1
MOST_STATES = 500_000
_FAR_BEHIND_M = -1e6


class Optima(NamedTuple):
    """The fastest ways through N episodes of at most D decisions.

    steps (N,): inner steps to the goal, search.IMPOSSIBLE where there is no way within the time
    limit. actions (N, D): Action, Stop beyond the end and where there is no way.
    at_least (N,): no way is shorter than so many steps. Equal to `steps`, and so a proof, but
    for a few episodes in dense traffic, whose proof would need more than MOST_STATES states.
    """

    steps: Integers
    actions: Integers
    at_least: Integers

    @property
    def proven(self) -> Booleans:
        """Whether the way is the very fastest, or there is none for certain (N,)."""
        return np.asarray(self.steps == self.at_least)


def require_indifferent(simulation: Simulation) -> None:
    """Refuse scenarios whose traffic reacts to the ego, and those whose ego is delayed.

    Raises:
        ScenarioError: a lane merges, where followers make room; vehicles yield to the ego or
            brake for it; or the ego's actions take effect later, which the search does not know.
    """
    scenario = simulation.scenario
    if scenario.ego.actuation_delay_s > 0.0:
        raise ScenarioError(
            f"in scenario {scenario.name} actions take effect {scenario.ego.actuation_delay_s} s "
            "later, expected at once: no optimum is computed"
        )
    if scenario.traffic.yielding_share > 0.0:
        reason = f"in scenario {scenario.name} vehicles yield to the ego"
    elif scenario.traffic.brakes_for_ego_after_s is not None:
        reason = f"in scenario {scenario.name} vehicles brake for the ego"
    elif simulation.world.lanes.merging.any():
        lane = simulation.world.lanes.id[simulation.world.lanes.merging][0]
        reason = f"on merging lane {lane} vehicles follow the ego"
    else:
        return
    raise ScenarioError(f"{reason}, expected traffic that does not react: no optimum is computed")


def film(simulation: Simulation, seeds: Seeds) -> Vehicles:
    """Return the traffic of B episodes after each of T inner steps, all (B, T, N).

    The simulation is left at the time limit. Only driving, path and s_m are filmed.
    """
    simulation.reset(seeds)
    episodes, vehicles, _ = simulation.state
    # Far away from everything the ego cannot end an episode before its time.
    episodes.ego_s_m[:] = _FAR_BEHIND_M
    steps = simulation.settings.limit_steps
    shape = (simulation.batch, steps, vehicles.driving.shape[1])
    driving = np.zeros(shape, dtype=np.bool_)
    path, s_m = np.zeros(shape, dtype=np.int64), np.zeros(shape)
    stop = np.full(simulation.batch, Action.STOP)
    for step in range(steps):
        simulation.inner_step(stop)
        driving[:, step] = vehicles.driving
        path[:, step] = vehicles.path
        s_m[:, step] = vehicles.s_m
    return vehicles._replace(driving=driving, path=path, s_m=s_m)


def optima(
    simulation: Simulation,
    seeds: Seeds,
    most_states: int = MOST_STATES,
    known: KnownOptima | None = None,
) -> Optima:
    """Return the fastest ways through the episodes of seeds (B,), B the simulation's batch.

    known: looked up before a search, and told what was found; all with one `most_states`.

    Raises:
        ScenarioError: the traffic reacts to the ego.
    """
    require_indifferent(simulation)
    known = KnownOptima() if known is None else known
    place = surroundings(simulation)
    simulation.reset(seeds)
    start_m = simulation.state.episodes.ego_s_m.copy()
    start_mps = simulation.state.episodes.ego_speed_mps.copy()
    traffic = film(simulation, seeds)
    settings = simulation.settings
    decisions = -(-settings.limit_steps // settings.decision_steps)
    batch = simulation.batch
    result = Optima(
        steps=np.full(batch, IMPOSSIBLE, dtype=np.int64),
        actions=np.full((batch, decisions), int(Action.STOP), dtype=np.int64),
        at_least=np.full(batch, IMPOSSIBLE, dtype=np.int64),
    )
    for b in range(batch):
        own, start = _frame(traffic, b), (float(start_m[b]), float(start_mps[b]))
        found = known.get(place, start, simulation, own)
        if found is None:
            found = _Episode(simulation, own, *start).solve(most_states)
            known.put(place, start, simulation, own, found)
        result.steps[b], result.at_least[b] = found.steps, found.at_least
        result.actions[b] = found.actions
    return result


def _frame(traffic: Vehicles, episode: int) -> Vehicles:
    """Return the film (T, N) of one episode."""
    return traffic._replace(
        driving=traffic.driving[episode], path=traffic.path[episode], s_m=traffic.s_m[episode]
    )


class _Episode:
    """One search after the other, each with more effort than the one before."""

    def __init__(
        self, simulation: Simulation, traffic: Vehicles, start_m: float, start_mps: float
    ) -> None:
        self._world, self._settings = simulation.world, simulation.settings
        self._rules = Rules(
            step_s=self._settings.step_s,
            decision_steps=self._settings.decision_steps,
            limit_steps=self._settings.limit_steps,
            goal_m=simulation.world.ego.goal_m,
        )
        self._speeds = speeds_from(self._settings.ego, self._rules, start_mps)
        self._traffic, self._start_m = traffic, start_m

    def solve(self, most_states: int) -> Optimum:
        """Return the fastest way, or the best one found and what no way undercuts."""
        rules, nothing = self._rules, no_bounds()
        limit = rules.limit_steps
        actions = np.full(-(-limit // rules.decision_steps), int(Action.STOP), dtype=np.int64)
        steps = self._search(nothing, limit, _SAME_M, min(_EASY_STATES, most_states), actions)
        if steps != GAVE_UP:
            return Optimum(steps, steps, actions, self._looked(steps))
        steps = self._search(nothing, limit, _COARSE_M, most_states, actions)
        found = steps >= 0
        latest = steps - 1 if found else limit
        bounds = lower_bounds(
            self._world.ego, self._world.paths, rules, self._speeds, self._traffic,
            self._start_m, latest,
        )  # fmt: skip
        looked = self._looked(steps)
        faster = self._search(bounds, latest, _SAME_M, most_states, actions)
        if faster >= 0:
            return Optimum(faster, faster, actions, looked)
        steps = steps if found else IMPOSSIBLE
        at_least = int(bounds.least[0, 0, 0]) if faster == GAVE_UP else steps
        return Optimum(steps, at_least, actions, looked)

    def _looked(self, steps: int) -> int:
        """Return how many inner steps of the film a search has read that ended after `steps`.

        No state is followed that cannot arrive by then, and a decision's steps at most beyond it.
        """
        limit = self._rules.limit_steps
        return min(steps + self._rules.decision_steps, limit) if steps >= 0 else limit

    def _search(
        self, bounds: Bounds, latest: int, merge_m: float, most_states: int, actions: Integers
    ) -> int:
        steps: int = fastest_way(
            self._world.ego, self._world.paths, self._settings.ego, self._rules, self._speeds,
            bounds, self._traffic, self._start_m, latest, merge_m, most_states, actions,
        )  # fmt: skip
        return steps


class ClairvoyantPolicy:
    """Drives the optima of the episodes that the simulation runs next.

    It looks at no situation: row b carries out actions (B, D) one after the other.
    """

    name = NAME

    def __init__(self, actions: NDArray[np.int64]) -> None:
        self._actions = actions
        self._done = 0

    @property
    def hash(self) -> str:
        """SHA-256 of the name: there is only one optimum."""
        return fingerprint({"policy": self.name})

    def decide(self, situations: Situations, restart: Booleans) -> Decisions:  # noqa: ARG002
        """Decide the next action of each row, and Stop once they are used up."""
        batch, known = self._actions.shape
        action = np.full(batch, int(Action.STOP), dtype=np.int64)
        if self._done < known:
            action[:] = self._actions[:, self._done]
        self._done += 1
        return bare_decisions(action, Reason.FIXED)
