# SPDX-License-Identifier: Apache-2.0
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest

from risk_dqn_planner.errors import ConfigurationError, ScenarioError
from risk_dqn_planner.map.loader import RoadMap
from sim_bridge.environment import place as place_module
from sim_bridge.environment.interface import Outcome
from sim_bridge.environment.place import Place
from sim_bridge.environment.registration import ID


def test_importing_the_environments_makes_them_known() -> None:
    program = f"import gymnasium, sim_bridge.environment; gymnasium.spec('{ID}')"
    found = subprocess.run(  # noqa: S603 (the program above)
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert found.returncode == 0, found.stderr


def test_the_name_may_say_what_to_import() -> None:
    one = gymnasium.make(f"sim_bridge.environment:{ID}", map="t_junction", scenario="base")
    assert one.spec.id == ID


def test_passes_gymnasiums_own_check() -> None:
    from gymnasium.utils.env_checker import check_env  # noqa: PLC0415

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(ID, render_mode="rgb_array").unwrapped)


def test_passes_the_check_of_stable_baselines3() -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(gymnasium.make(ID).unwrapped)


def test_a_seed_names_the_same_episode_alone_and_in_a_vector() -> None:
    one = gymnasium.make(ID)
    many = gymnasium.make_vec(ID, num_envs=3)
    states, _ = many.reset(seed=40)
    for k in range(3):
        alone, _ = one.reset(seed=40 + k)
        np.testing.assert_array_equal(states[k], alone)


def test_lanes_reach_as_far_as_the_sensor_sees(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, place_on = [], place_module.place_on

    def build(name: str, road_map: RoadMap, route: tuple[int, ...], reach_m: float) -> Place:
        asked.append(reach_m)
        return place_on(name, road_map, route, reach_m)

    monkeypatch.setattr(place_module, "place_on", build)
    gymnasium.make(ID, scenario="demo_light")
    assert max(asked) == 100.0


def test_time_limit_truncates_and_goal_or_collision_terminates() -> None:
    many = gymnasium.make_vec(ID, num_envs=16, reward="collision")
    many.reset(seed=0)
    for _ in range(60):
        _, _, terminated, truncated, info = many.step(np.full(16, 2))
        assert not truncated.any()
        np.testing.assert_array_equal(terminated, info["outcome"] != Outcome.RUNNING)
    one = gymnasium.make(ID)
    one.reset(seed=0)
    for _ in range(119):
        assert not any(one.step(0)[2:4])
    *_, terminated, truncated, info = one.step(0)
    assert (terminated, truncated, info) == (False, True, {"outcome": "timeout"})


def test_renders_the_view_from_above() -> None:
    one = gymnasium.make(ID, render_mode="rgb_array")
    one.reset(seed=1)
    before = one.render()
    assert before.shape == (480, 480, 3)
    assert before.dtype == np.uint8
    for _ in range(6):
        one.step(2)
    assert (one.render() != before).any()


def test_unknown_names_are_refused() -> None:
    with pytest.raises(ScenarioError, match="no scenario 'fog'"):
        gymnasium.make(ID, scenario="fog")
    with pytest.raises(ConfigurationError, match="no reward 'comfort'"):
        gymnasium.make(ID, reward="comfort")
