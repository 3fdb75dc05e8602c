# SPDX-License-Identifier: Apache-2.0
"""Drives the set `soundness`: policies and limits in all cells, timeouts classified."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rich.console import Console

from risk_dqn_planner.errors import ConfigurationError, UnknownPolicyError
from risk_dqn_planner.map.loader import DEFAULT_PROJECTOR, MapOrigin
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from sim_bridge.environment.place import Places
from sim_bridge.evaluation.campaign import Campaign, entries_in_sight, versions
from sim_bridge.evaluation.progress import progress_on
from sim_bridge.evaluation.rollout import Clairvoyant, Contestant
from sim_bridge.evaluation.soundness.cells import (
    GOAL,
    GRANTED,
    MAPS,
    SEARCHING,
    UNAIDED,
    SoundnessCell,
    missing_scenarios,
    soundness_cells,
)
from sim_bridge.evaluation.soundness.drivers import Drivers, is_sound
from sim_bridge.evaluation.soundness.limits import PhysicalLimit, SoundLimit
from sim_bridge.evaluation.soundness.timeouts import SUCCESS, classified, united
from sim_bridge.evaluation.statistics import wilson
from sim_bridge.evaluation.store import Store

EPISODES, SEARCH_EPISODES, LIMIT_EPISODES = 100_000, 2000, 300

Line = dict[str, Any]


@dataclass(frozen=True)
class Plan:
    """How much of the set is driven.

    search_episodes: the first ones, for policies that search at each decision; limit_episodes:
    the first ones of those, for the limits. sound_episodes: for all others that take sound actions
    by themselves, in the cells where these may not collide; None for as many as elsewhere.

    maps: names of own maps, or one .osm file; empty for all own ones. route, origin, projector: of
    a single map, as in `load_place`. scenarios, policies: only these; empty for all.
    output: folder of finished cells.
    """

    output: Path
    episodes: int = EPISODES
    search_episodes: int = SEARCH_EPISODES
    limit_episodes: int = LIMIT_EPISODES
    sound_episodes: int | None = None
    maps: tuple[str, ...] = ()
    route: tuple[int, ...] | None = None
    origin: MapOrigin | None = None
    projector: str = DEFAULT_PROJECTOR
    scenarios: tuple[str, ...] = ()
    policies: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("episodes", "search_episodes", "limit_episodes", "sound_episodes"):
            count = getattr(self, name)
            if count is not None and count < 1:
                raise ConfigurationError(f"{name} is {count}, expected 1 or more")
        if (self.route or self.origin) and len(self.maps) != 1:
            named = ", ".join(self.maps or MAPS)
            raise ConfigurationError(f"route and origin belong to one map, but there are {named}")

    def cells(self) -> list[SoundnessCell]:
        """Return the cells to be driven, each with its policies.

        Raises:
            ConfigurationError: nothing is left.
        """
        chosen = [
            replace(cell, policies=tuple(p for p in cell.policies if self._takes(p)))
            for cell in soundness_cells(self.maps or MAPS)
            if not self.scenarios or cell.cell.scenario in self.scenarios
        ]
        if not any(cell.policies for cell in chosen):
            raise ConfigurationError("no cell of the set is left by maps, scenarios and policies")
        return chosen

    def places(self, map_name: str) -> Places:
        """Return where one of the maps has its episodes.

        Raises:
            ConfigurationError, MapError, RouteError: as `load_place`.
        """
        return Places.named(map_name, self.route, self.origin, self.projector)

    def episodes_of(self, policy: str, cell: SoundnessCell) -> int:
        """Return how many episodes of a cell a policy drives."""
        if policy in SEARCHING:
            return min(self.episodes, self.search_episodes)
        if policy in UNAIDED and cell.part in (GOAL, GRANTED) and self.sound_episodes is not None:
            return max(self.sound_episodes, self.limited)
        return self.episodes

    @property
    def limited(self) -> int:
        """Return of how many episodes the limits are searched, which everybody drives."""
        return min(self.limit_episodes, self.search_episodes, self.episodes)

    def _takes(self, policy: str) -> bool:
        return not self.policies or policy in self.policies


@dataclass
class _Work:
    """What several cells share."""

    plan: Plan
    drivers: Drivers = field(default_factory=Drivers)
    clairvoyant: Clairvoyant = field(default_factory=Clairvoyant)
    places: dict[str, Places] = field(default_factory=dict)

    def campaign(self, cell: SoundnessCell, episodes: int) -> Campaign:
        """Return what drives so many episodes in a cell; the first are held against the limits."""
        if cell.map_name not in self.places:
            self.places[cell.map_name] = self.plan.places(cell.map_name)
        store = Store(self.plan.output / "cells")
        places, first = self.places[cell.map_name], self.plan.limited
        return Campaign(places, episodes, store, first, cell.assumptions)


def run(plan: Plan, console: Console) -> tuple[dict[str, Any], list[Line]]:
    """Return head and lines of results.json, limits first in each cell.

    Raises:
        PlannerError: a policy, map or scenario cannot be used.
    """
    work, lines = _Work(plan), []
    cells = _with_known_policies(plan.cells(), work.drivers, console)
    total = sum(
        sum(plan.episodes_of(name, cell) for name in cell.policies) + 2 * cell.limits * plan.limited
        for cell in cells
    )
    with progress_on(console) as progress:
        task = progress.add_task("", total=total)
        for cell in cells:
            own = []
            for driver, episodes in _who(cell, work):
                where = f"{cell.map_name} {cell.cell.scenario}"
                progress.update(task, description=f"{driver.name} {where}")
                campaign = work.campaign(cell, episodes)
                line = campaign.result(
                    driver, cell.cell, lambda count: progress.advance(task, count)
                )
                own.append(_described(line, cell))
            lines += _judged(own, cell)
    return _head(work, cells), lines


def _head(work: _Work, cells: Sequence[SoundnessCell]) -> dict[str, Any]:
    """Return what the results depend on, and what of the set is not in them."""
    maps = dict.fromkeys(cell.map_name for cell in cells)
    head = versions(work.places[next(iter(maps))].usual, [])
    head["map"] = ",".join(maps)
    head["policies"] = list(dict.fromkeys(name for cell in cells for name in cell.policies))
    head["missing"] = missing_scenarios()
    first = [next(cell for cell in cells if cell.map_name == name) for name in maps]
    head["entries_in_sight_m"] = {}
    for cell in first:
        head["entries_in_sight_m"] |= entries_in_sight(work.places[cell.map_name], cell.cell)
    return head


def _with_known_policies(
    cells: Sequence[SoundnessCell], drivers: Drivers, console: Console
) -> list[SoundnessCell]:
    """Leave out policies that this version does not have, and say so."""
    names = dict.fromkeys(name for cell in cells for name in cell.policies)
    unknown = {name for name in names if not _is_known(name, drivers, console)}
    return [
        replace(cell, policies=tuple(p for p in cell.policies if p not in unknown))
        for cell in cells
    ]


def _is_known(name: str, drivers: Drivers, console: Console) -> bool:
    try:
        drivers.of(name, SafetyAssumptions())
    except UnknownPolicyError as error:
        console.print(f"{name} is left out: {error}")
        return False
    return True


def _who(cell: SoundnessCell, work: _Work) -> list[tuple[Contestant, int]]:
    """Return who drives in a cell, and how many episodes."""
    plan, limited = work.plan, work.plan.limited
    found: list[tuple[Contestant, int]] = []
    if cell.limits:
        place = work.campaign(cell, limited).places.of(cell.cell.load())
        found += [
            (PhysicalLimit(place, work.clairvoyant), limited),
            (SoundLimit(place, cell.assumptions), limited),
        ]
    return found + [
        (work.drivers.of(name, cell.assumptions), plan.episodes_of(name, cell))
        for name in cell.policies
    ]


def _described(line: Line, cell: SoundnessCell) -> Line:
    """Return a line with all that tells the set's cells apart."""
    return {
        "part": cell.part,
        **line,
        "sensor_forward_m": cell.cell.sensor_forward_m,
        "memory": cell.cell.memory,
        "brakes_for_ego_after_s": cell.cell.brakes_for_ego_after_s,
        "hidden_top_speed_mps": cell.assumptions.hidden_top_speed_mps,
        "speed_error_mps": cell.assumptions.speed_error_mps,
        "sound": is_sound(line["policy"]),
        "assumptions_hold": cell.holds,
    }


def _judged(lines: Sequence[Line], cell: SoundnessCell) -> list[Line]:
    """Return a cell's lines with the limits, and their timeouts by cause.

    Whatever anyone reached is possible, and whatever a sound policy reached soundly so.
    """
    first = [line.pop("first") for line in lines]
    if not cell.limits:
        return list(lines)
    letters = [each["letters"] for each in first]
    sounds = [own for own, line in zip(letters, lines, strict=True) if line["sound"]]
    sound = united([letters[1], *sounds])
    physical = united([letters[0], sound, *letters[2:]])
    for own, line in zip(first, lines, strict=True):
        line["limits"] = {
            "episodes": len(sound),
            "clairvoyant": _share(physical),
            "sound_limit": _share(sound),
            "success": _share(own["letters"]),
            "mean_speed_mps": own["mean_speed_mps"],
        }
        line["timeouts"] = classified(own["letters"], physical, sound)._asdict()
    return list(lines)


def _share(letters: str) -> dict[str, float]:
    share = wilson(letters.count(SUCCESS), len(letters))
    return {key: round(value, 6) for key, value in share._asdict().items()}
