# SPDX-License-Identifier: Apache-2.0
"""Launch files declare what they use and use what they declare, for nodes that know it.

They are run here with stand-ins for `launch` and `launch_ros`, which not every ROS environment of
this project has; where the real ones are installed, they are loaded with these as well.
"""

import importlib.util
import sys
import types
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import pytest

from risk_dqn_planner.ros.lifecycle import LifecycleParameters
from risk_dqn_planner.ros.parameters import (
    ClockParameters,
    MapParameters,
    PolicyParameters,
    StandingClockParameters,
)
from risk_dqn_planner.situation.config import SituationConfig
from sim_bridge.ros import topics
from sim_bridge.ros.simulator_parameters import SimulatorParameters

SOURCES = Path(__file__).resolve().parents[1] / "src"
PLANNER = SOURCES / "risk_dqn_planner" / "launch" / "planner.launch.py"
SIMULATOR = SOURCES / "sim_bridge" / "launch" / "simulator.launch.py"
DEMO = SOURCES / "sim_bridge" / "launch" / "demo.launch.py"
STAND_INS = (
    "launch", "launch.actions", "launch.conditions", "launch.substitutions",
    "launch.launch_description_sources", "launch_ros", "launch_ros.actions",
    "launch_ros.parameter_descriptions",
)  # fmt: skip


class Recorded:
    """Anything a launch file makes: what it was made of."""

    def __init__(self, *parts: Any, **named: Any) -> None:  # noqa: ANN401
        self.parts = parts
        self.named = named


class DeclareLaunchArgument(Recorded):
    pass


class IncludeLaunchDescription(Recorded):
    pass


class LaunchConfiguration(Recorded):
    pass


class Node(Recorded):
    pass


@dataclass
class Loaded:
    """What is in a launch description."""

    arguments: dict[str, DeclareLaunchArgument] = field(default_factory=dict)
    nodes: dict[str, Node] = field(default_factory=dict)
    includes: dict[str, dict[str, Any]] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)


def run(path: Path, monkeypatch: pytest.MonkeyPatch) -> Loaded:
    """Run a launch file with the stand-ins."""
    for name in STAND_INS:
        module: Any = types.ModuleType(name)
        for kind in (DeclareLaunchArgument, IncludeLaunchDescription, LaunchConfiguration, Node):
            setattr(module, kind.__name__, kind)
        for other in (
            "LaunchDescription", "IfCondition", "PythonLaunchDescriptionSource", "ParameterValue"
        ):  # fmt: skip
            setattr(module, other, Recorded)
        monkeypatch.setitem(sys.modules, name, module)
    loaded = Loaded()
    for each in load(path).generate_launch_description().parts[0]:
        if isinstance(each, DeclareLaunchArgument):
            assert each.parts[0] not in loaded.arguments, "declared twice"
            loaded.arguments[each.parts[0]] = each
        elif isinstance(each, Node):
            loaded.nodes[each.named["name"]] = each
        else:
            file = Path(each.parts[0].parts[0]).name
            loaded.includes[file] = dict(each.named["launch_arguments"])
        loaded.used.update(configurations(each))
    return loaded


def load(path: Path) -> Any:  # noqa: ANN401 (a module)
    specification = importlib.util.spec_from_file_location("launch_file", path)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def configurations(part: Any) -> Iterator[str]:  # noqa: ANN401
    """Names of the launch configurations that a part is made of, however deep."""
    if isinstance(part, LaunchConfiguration):
        yield part.parts[0]
    elif isinstance(part, Recorded):
        yield from configurations(part.parts)
        yield from configurations(part.named)
    elif isinstance(part, dict):
        yield from configurations(list(part.values()))
    elif isinstance(part, list | tuple):
        for each in part:
            yield from configurations(each)


@pytest.fixture(params=[PLANNER, SIMULATOR], ids=["planner", "simulator"])
def loaded(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Loaded:
    return run(request.param, monkeypatch)


def test_every_argument_is_used_and_every_one_used_is_declared(loaded: Loaded) -> None:
    assert loaded.used == set(loaded.arguments)


def test_every_argument_is_described_and_has_a_default_or_says_that_it_has_none(
    loaded: Loaded,
) -> None:
    for name, argument in loaded.arguments.items():
        text, default = argument.named["description"], argument.named["default_value"]
        assert len(text.split()) >= 2, name
        assert (default is None) == ("(required)" in text), name
        assert default is None or isinstance(default, str), name


def parameters(node: Node) -> set[str]:
    return {
        name
        for part in node.named["parameters"]
        if isinstance(part, dict)
        for name in part
        if name != "use_sim_time"
    }


def names(*configs: Any) -> set[str]:  # noqa: ANN401
    return {each.name for config in configs for each in fields(config)}


def test_nodes_get_parameters_that_they_know(monkeypatch: pytest.MonkeyPatch) -> None:
    planner, simulator = run(PLANNER, monkeypatch).nodes, run(SIMULATOR, monkeypatch).nodes
    assert parameters(planner["situation"]) <= names(
        MapParameters, SituationConfig, LifecycleParameters, ClockParameters
    )
    assert parameters(planner["policy"]) <= names(
        PolicyParameters, LifecycleParameters, ClockParameters, StandingClockParameters
    )
    assert parameters(simulator["simulator"]) <= names(SimulatorParameters, MapParameters) | {
        "route"
    }
    for node in ("situation", "policy"):
        assert planner[node].named["executable"] == f"{node}_node"


def test_limits_of_simulated_time_are_the_nodes_own_by_default(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    arguments = run(PLANNER, monkeypatch).arguments
    for config in (ClockParameters(), StandingClockParameters()):
        for name, value in vars(config).items():
            assert float(arguments[name].named["default_value"]) == value


@pytest.mark.parametrize("name", ["situation", "policy", "simulator"])
def test_every_topic_of_a_node_can_be_renamed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    path = SIMULATOR if name == "simulator" else PLANNER
    found = run(path, monkeypatch)
    given = dict(found.nodes[name].named["remappings"])
    assert {private: value.parts[0] for private, value in given.items()} == {
        topic.ends[name]: f"{topic.name.removeprefix('/')}_topic"
        for topic in topics.ALL
        if name in topic.ends
    }
    for topic in topics.ALL:
        argument = found.arguments.get(f"{topic.name.removeprefix('/')}_topic")
        if argument is not None:
            assert f"/{topic.name}" == f"/{'/'}{argument.named['default_value']}"


def test_the_demo_is_both_on_one_map_and_one_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    demo = run(DEMO, monkeypatch)
    assert list(demo.includes) == ["simulator.launch.py", "planner.launch.py"]
    arguments = set(run(PLANNER, monkeypatch).arguments)
    assert set(demo.includes["planner.launch.py"]) <= arguments
    for fixed in ("use_sim_time", "autostart"):
        assert demo.includes["planner.launch.py"][fixed] == "true"
    # The clock stands while the simulator waits for a late situation, and then for a decision.
    waits_s = 2.0 * SimulatorParameters.decision_timeout_s
    assert float(demo.includes["planner.launch.py"]["clock_timeout_s"]) >= waits_s
    assert demo.used <= set(run(SIMULATOR, monkeypatch).arguments)


@pytest.mark.parametrize("path", [PLANNER, SIMULATOR, DEMO], ids=lambda path: path.stem)
def test_the_real_launch_loads_the_files(path: Path) -> None:
    pytest.importorskip("launch_ros.actions", reason="launch_ros is not installed")
    described = load(path).generate_launch_description()
    for argument in described.get_launch_arguments():
        assert argument.description
