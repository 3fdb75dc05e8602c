# SPDX-License-Identifier: Apache-2.0
"""Which bags there are: what each shows, and which episode shows it.

The seeds were searched for: in these episodes the thing that a bag is named after happens early
and the ego arrives, so that the bags stay short. Algorithm 1 (rule_based) stays as it is; bags of
the planner's default policy are to be recorded again whenever another one is shipped.
"""

from dataclasses import replace
from typing import NamedTuple

from risk_dqn_planner.policies.shipped import DEFAULT_POLICY, DEFAULT_SUPERVISOR
from risk_dqn_planner.situation.config import TRACKED
from sim_bridge.ros.input_loss import InputLoss
from sim_bridge.ros.run_settings import RunSettings, own_map_settings

_RULE = "rule_based"
_SOUND = "fastest_sound"
_DARING = "tuned"  # drives where sound policies wait, so that vehicles can take it by surprise


class PlannedBag(NamedTuple):
    """One bag: what it shows, in a sentence, and the episode, by its seed."""

    shows: str
    settings: RunSettings
    seed: int

    def notes(self) -> dict[str, str]:
        """Return what the bag says about itself."""
        return {**self.settings.notes(), "seed": str(self.seed), "shows": self.shows}


def _bag(
    shows: str, where: str, scenario: str, policy: str, seed: int, supervisor: str = "off"
) -> PlannedBag:
    return PlannedBag(shows, own_map_settings(where, policy, scenario, supervisor), seed)


def _losing(name: str, after_s: float, for_s: float) -> PlannedBag:
    shows = f"The input {name} falls silent for {for_s:g} s and comes back"
    planned = _bag(shows, "four_way", "demo_light", _RULE, 0)
    loss = InputLoss(name, after_s, for_s)
    return planned._replace(settings=replace(planned.settings, loss=loss))


def _remembering(planned: PlannedBag) -> PlannedBag:
    return planned._replace(settings=replace(planned.settings, memory=TRACKED))


def bags() -> dict[str, PlannedBag]:
    """Return what is recorded in each bag, by the bag's name."""
    free = "Few vehicles on the map {}, in good sight from the stop line".format
    maps = {
        name: _bag(free(name), name, "demo_light", _RULE, 0)
        for name in ("four_way", "t_junction", "multi_lane", "roundabout")
    }
    return {
        **maps,
        "default_policy": _bag(
            "The default policy",
            "four_way", "base", DEFAULT_POLICY, 3, DEFAULT_SUPERVISOR,
        ),
        "dense_traffic": _bag(
            "Many vehicles close behind each other; the supervisor overrules a daring policy",
            "four_way", "dense_traffic", _DARING, 133, "enforce",
        ),
        "severe_occlusion": _remembering(
            _bag(
                "Buildings up to the kerb; hidden space is remembered",
                "t_junction", "severe_occlusion", _SOUND, 128,
            )
        ),
        "sensor_noise": _bag(
            "Perceived speeds err by 1 m/s", "multi_lane", "sensor_noise", _RULE, 20
        ),
        "short_range": _bag(
            "A sensor that sees 40 m", "t_junction", "short_sensor_range", _SOUND, 47
        ),
        "odometry_lost": _losing("odometry", 6.0, 2.0),
        "objects_lost": _losing("objects", 6.0, 3.0),
        "emergency": _bag(
            "A vehicle comes out from behind an obstacle right before the ego",
            "t_junction", "severe_occlusion", _DARING, 177, "report",
        ),
        "near_miss": _bag(
            "The ego leaves a conflict zone 0.1 s before another vehicle is in it",
            "four_way", "base", _RULE, 24,
        ),
        "merge": _bag(
            "Into the gaps of a roundabout's traffic", "roundabout", "base", _SOUND, 91
        ),
    }  # fmt: skip
