# SPDX-License-Identifier: Apache-2.0
"""The fastest way that can be found through episodes, driven in the simulation itself.

From each moment on every allowed action is tried, each on a copy of the whole episode. So it takes
whatever the simulation holds: followers that make room, traffic that brakes, noise, the memory of
what was seen, and the joint check with all that it remembers along the way.

Moments of one episode at one time that have nearly the same place and speed are taken for one,
and at most `width` of them are followed: spread over all places and speeds, the furthest first,
and always the one that took the fastest action that was allowed each time. So with the check no
way is slower than that of the policy that takes the fastest sound action. A way that is found is a
way, while one that is not found may exist: the shares of episodes are lower bounds of what is
possible.

With room for all moments, and cells so small that only equal ones fall into one, the search is
exact where everything that matters is told apart: place, speed, all traffic, and the manoeuvre
verified last. Two things that depend on the way are not: since when followers in a merging lane
have seen the ego, and the memory of what was seen. Of moments that differ in nothing else the one
that came by the faster action is followed.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from risk_dqn_planner.decision import Action
from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.safety.guard import Guard
from risk_dqn_planner.safety.joint_check import NO_MANOEUVRE, JointCheck
from risk_dqn_planner.situation.situations import Booleans, Integers
from sim_bridge.environment.batch import outcomes
from sim_bridge.environment.episodes import DrivenEpisodes
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.seeds import Seeds
from sim_bridge.evaluation.soundness.rows import copy_rows, keep_memory
from sim_bridge.simulation.simulation import EpisodeStatistics, Simulation

NOBODY = -1
_ACTIONS = len(Action)
# Where there are more moments than room, they are spread over places and speeds so far apart.
_PLACE_M, _SPEED_MPS = 1.0, 1.25


@dataclass(frozen=True)
class BeamConfig:
    """How much is followed. cell_m, cell_mps: what counts as the same place and speed."""

    width: int = 64
    cell_m: float = 0.02
    cell_mps: float = 0.05

    def __post_init__(self) -> None:
        for name in ("width", "cell_m", "cell_mps"):
            if not getattr(self, name) > 0:
                raise ConfigurationError(
                    f"BeamConfig.{name} is {getattr(self, name)}, expected a number above 0"
                )


class Moments(NamedTuple):
    """K moments that may be followed further, all (K,).

    row: where it is; parent: row of the moment before, action: what led here; episode: which;
    greedy: whether the fastest allowed action was taken all along.
    """

    row: Integers
    parent: Integers
    action: Integers
    episode: Integers
    greedy: Booleans


class Beam:
    """Searches many episodes side by side.

    narrow: a simulation with room for the moments that are looked at, batch R; wide: the same
    with room for what follows, batch 3 R. assumptions: of the check that every action has to
    pass; None for no check.
    """

    def __init__(
        self,
        narrow: Simulation,
        wide: Simulation,
        assumptions: SafetyAssumptions | None,
        config: BeamConfig,
    ) -> None:
        if wide.batch != _ACTIONS * narrow.batch or narrow.batch < config.width:
            raise ConfigurationError(
                f"batches of {narrow.batch} and {wide.batch} do not fit a width of {config.width}"
            )
        self._narrow, self._wide, self._config = narrow, wide, config
        self._guard = None if assumptions is None else Guard(assumptions)
        self._situations = narrow.situations() if self._guard else None
        self._episode = np.full(narrow.batch, NOBODY)
        self._begun = np.zeros(narrow.batch, dtype=np.bool_)
        self._greedy = np.zeros(narrow.batch, dtype=np.bool_)

    def search(self, seeds: Seeds) -> DrivenEpisodes:
        """Return how the best way found through each episode of seeds (N,) went.

        Without a way: a timeout as far on as possible; a collision where every way ends in one.
        """
        result = _empty(seeds)
        waiting = iter(range(len(seeds)))
        self._episode[:] = NOBODY
        self._admit(seeds, waiting, 0)
        while (self._episode != NOBODY).any():
            check, moments = self._follow()
            moments = self._conclude(moments, result)
            moments = self._chosen(check, moments)
            self._take_over(check, moments)
            self._admit(seeds, waiting, len(moments.row))
        return result

    def _admit(self, seeds: Seeds, waiting: Iterator[int], used: int) -> None:
        """Begin further episodes behind the rows used, as many as surely have room."""
        self._begun[:] = False
        self._episode[used:] = NOBODY
        self._narrow.state.episodes.running[used:] = False
        active = len(np.unique(self._episode[:used]))
        room = self._narrow.batch // self._config.width - active
        new = [k for _, k in zip(range(max(room, 0)), waiting, strict=False)]
        if not new:
            return
        rows = slice(used, used + len(new))
        chosen = np.zeros(self._narrow.batch, dtype=np.int64)
        chosen[rows] = seeds[new]
        self._begun[rows] = True
        self._episode[rows] = new
        self._greedy[rows] = True
        self._narrow.reset(chosen, self._begun)

    def _allowed(self) -> tuple[JointCheck | None, Booleans]:
        """Return the check, and what each row may do (R, 3)."""
        there = (self._episode != NOBODY)[:, None]
        if self._guard is None or self._situations is None:
            return None, np.broadcast_to(there, (len(there), _ACTIONS))
        self._narrow.situations(out=self._situations)
        check = self._guard.look(self._situations, self._begun)
        return check, self._guard.sound(check) & there

    def _follow(self) -> tuple[JointCheck | None, Moments]:
        """Carry out all that is allowed, in `wide`, and return what it led to."""
        check, allowed = self._allowed()
        parent, action = np.nonzero(allowed)
        copy_rows(self._narrow, parent, self._wide)
        given = np.zeros(self._wide.batch, dtype=np.int64)
        given[: len(action)] = action
        self._outcome = outcomes(self._wide.step(given))
        fastest = _ACTIONS - 1 - allowed[:, ::-1].argmax(axis=1)
        greedy = self._greedy[parent] & (action == fastest[parent])
        moments = Moments(np.arange(len(parent)), parent, action, self._episode[parent], greedy)
        # Of moments that are alike the first one stays: the greedy one, or the faster action.
        return check, _some(moments, np.lexsort((-action, ~greedy)))

    def _conclude(self, moments: Moments, result: DrivenEpisodes) -> Moments:
        """Note the episodes that end here; return the moments of the others that go on.

        All moments of an episode have the same time, so the first to arrive are the fastest.
        """
        outcome = self._outcome[moments.row]
        running = outcome == Outcome.RUNNING
        state = self._wide.state.episodes
        worth = np.where(outcome == Outcome.SUCCESS, 1e9 - state.tick[moments.row], 0.0)
        worth += np.where(outcome == Outcome.TIMEOUT, 1e6 + state.ego_s_m[moments.row], 0.0)
        arrived = np.unique(moments.episode[outcome == Outcome.SUCCESS])
        going_on = np.setdiff1d(moments.episode[running], arrived)
        ended = np.flatnonzero(~running & ~np.isin(moments.episode, going_on))
        if len(ended) == 0:
            return _some(moments, running & np.isin(moments.episode, going_on))
        statistics = self._wide.statistics()
        # The best of each episode comes last, so that it is the one that stays.
        for k in ended[np.argsort(worth[ended], kind="stable")]:
            episode = moments.episode[k]
            result.outcome[episode] = outcome[k]
            for column, own in zip(result.statistics, statistics, strict=True):
                column[episode] = own[moments.row[k]]
        return _some(moments, running & np.isin(moments.episode, going_on))

    def _chosen(self, check: JointCheck | None, moments: Moments) -> Moments:
        """Return one of those that are alike, and no more of an episode than there is room."""
        state, config = self._wide.state, self._config
        s_m = state.episodes.ego_s_m[moments.row]
        speed_mps = state.episodes.ego_speed_mps[moments.row]
        # Traffic that has reacted to the ego makes another moment of the same place and speed.
        driving = state.vehicles.driving[moments.row]
        others_m = np.where(driving, state.vehicles.s_m[moments.row], 0.0).sum(axis=1)
        _, first = np.unique(
            _mixed(
                moments.episode,
                np.round(s_m / config.cell_m),
                np.round(speed_mps / config.cell_mps),
                np.round(others_m / config.cell_m),
                self._manoeuvres(check, moments),
            ),
            return_index=True,
        )
        moments, s_m, speed_mps = _some(moments, first), s_m[first], speed_mps[first]
        place, speed = np.floor(s_m / _PLACE_M), np.ceil(speed_mps / _SPEED_MPS)
        groups = np.lexsort((-s_m, speed, place, moments.episode))
        turn = np.empty(len(first), dtype=np.int64)
        turn[groups] = _running_index(moments.episode[groups], place[groups], speed[groups])
        order = np.lexsort((-s_m, turn, ~moments.greedy, moments.episode))
        kept = order[_running_index(moments.episode[order]) < config.width]
        return _some(moments, kept)

    def _manoeuvres(self, check: JointCheck | None, moments: Moments) -> Integers:
        """Return what tells apart the manoeuvres verified before each moment (K,)."""
        if self._guard is None or check is None:
            return np.zeros(len(moments.row), dtype=np.int64)
        found = check.periods[moments.parent, moments.action]
        # What was not found again is the rest of what was verified before the parent.
        return np.where(found != NO_MANOEUVRE, found, -2 - self._guard.periods[moments.parent])

    def _take_over(self, check: JointCheck | None, moments: Moments) -> None:
        """Make the chosen moments the present ones."""
        count = len(moments.row)
        copy_rows(self._wide, moments.row, self._narrow)
        parent, action = np.zeros((2, self._narrow.batch), dtype=np.int64)
        parent[:count], action[:count] = moments.parent, moments.action
        keep_memory(self._narrow, parent)
        if self._guard is not None and check is not None:
            self._guard.keep(parent)
            self._guard.decided(JointCheck._make(part[parent] for part in check), action)
        self._episode[:count], self._greedy[:count] = moments.episode, moments.greedy


def _some(moments: Moments, which: NDArray[np.int64] | Booleans) -> Moments:
    return Moments._make(column[which] for column in moments)


def _running_index(*keys: NDArray[np.generic]) -> Integers:
    """Return the index of each of K sorted entries among those with equal keys, all (K,)."""
    count = len(keys[0])
    new = np.ones(count, dtype=np.bool_)
    new[1:] = np.logical_or.reduce([key[1:] != key[:-1] for key in keys])
    index = np.arange(count)
    start: NDArray[np.int64] = np.maximum.accumulate(np.where(new, index, 0))
    return index - start


def _mixed(*columns: NDArray[Any]) -> NDArray[np.uint64]:
    """Return a number (K,) for each row of whole numbers, equal only for equal rows.

    64 bits that are mixed well: that two of a million rows agree by accident takes luck of 1e-7.
    """
    mixed = np.zeros(len(columns[0]), dtype=np.uint64)
    for column in columns:
        mixed ^= column.astype(np.int64).view(np.uint64)
        mixed *= np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(32)
        mixed *= np.uint64(0xD6E8FEB86659FD93)
        mixed ^= mixed >> np.uint64(29)
    return mixed


def _empty(seeds: Seeds) -> DrivenEpisodes:
    count, whole = len(seeds), np.int64
    statistics = EpisodeStatistics(
        duration_s=np.zeros(count),
        progress_m=np.zeros(count),
        mean_speed_mps=np.zeros(count),
        action_counts=np.zeros((count, _ACTIONS), dtype=whole),
        action_changes=np.zeros(count, dtype=whole),
        hard_brakes=np.zeros(count, dtype=whole),
        least_time_gap_s=np.zeros(count),
    )
    return DrivenEpisodes(seeds, np.full(count, Outcome.RUNNING, dtype=whole), statistics)
