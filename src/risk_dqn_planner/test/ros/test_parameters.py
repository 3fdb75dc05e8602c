# SPDX-License-Identifier: Apache-2.0
"""Parameters are the fields of the configuration, with the same defaults and in the same bounds."""

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import rclpy
import yaml
from rclpy.context import Context
from rclpy.node import Node
from rclpy.parameter import Parameter

from risk_dqn_planner.errors import ConfigurationError
from risk_dqn_planner.intersection.config import IntersectionConfig
from risk_dqn_planner.ros.adapters.kinds import ObjectsAdapter
from risk_dqn_planner.ros.decider import DeciderConfig
from risk_dqn_planner.ros.declaration import Declared, declare
from risk_dqn_planner.ros.lifecycle import LifecycleParameters
from risk_dqn_planner.ros.parameters import (
    ClockParameters,
    EgoParameters,
    MapParameters,
    PolicyParameters,
    StandingClockParameters,
    add_assumptions,
    read_assumptions,
)
from risk_dqn_planner.ros.streams import AgeLimits, InputRates, SituationRates
from risk_dqn_planner.ros.synchroniser import SynchroniserConfig
from risk_dqn_planner.safety.assumptions import SafetyAssumptions
from risk_dqn_planner.situation.config import SituationConfig
from risk_dqn_planner.situation.limits import PlausibilityLimits
from risk_dqn_planner.vehicle import EgoLimits, TrafficLimits, VehicleDimensions

MakeNode = Callable[..., Node]

PLANNER_YAML = Path(__file__).resolve().parents[2] / "config" / "planner.yaml"


@dataclass(frozen=True)
class Example:
    speed_mps: float = field(
        default=1.0, metadata={"description": "How fast", "minimum": 0.0, "maximum": 5.0}
    )
    count: int = 3
    name: str = "a"
    on: bool = True
    size: VehicleDimensions = field(default_factory=VehicleDimensions)
    other: tuple[int, ...] = (1, 2)


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    context = Context()
    rclpy.init(context=context)
    yield context
    context.try_shutdown()


@pytest.fixture
def make_node(context: Context) -> Iterator[MakeNode]:
    made: list[Node] = []

    def make(**overrides: object) -> Node:
        # Dots cannot be written in keywords.
        given = [Parameter(name.replace("__", "."), value=v) for name, v in overrides.items()]
        node = Node("example", context=context, parameter_overrides=given)
        made.append(node)
        return node

    yield make
    for node in made:
        node.destroy_node()


def test_without_overrides_the_defaults_of_the_dataclass_hold(make_node: MakeNode) -> None:
    node = make_node()
    assert declare(node, Example) == Example()
    assert node.get_parameter("speed_mps").value == 1.0
    assert not node.has_parameter("other")


def test_overrides_reach_the_dataclass_nested_ones_by_prefix(make_node: MakeNode) -> None:
    node = make_node(x__speed_mps=2.5, x__size__length_m=5.0, x__on=False)
    expected = Example(speed_mps=2.5, size=VehicleDimensions(length_m=5.0), on=False)
    assert declare(node, Example, prefix="x.") == expected


def test_given_values_are_no_parameters(make_node: MakeNode) -> None:
    node = make_node(count=9)
    assert declare(node, Example, given={"count": 5}).count == 5
    assert not node.has_parameter("count")


def test_parameters_are_described_bounded_and_fixed(make_node: MakeNode) -> None:
    node = make_node()
    declare(node, Example)
    speed = node.describe_parameter("speed_mps")
    bounds = speed.floating_point_range[0]
    assert speed.description == "How fast"
    assert speed.read_only
    assert (bounds.from_value, bounds.to_value) == (0.0, 5.0)
    assert node.describe_parameter("size.length_m").description == "Size length [m]"
    assert not node.set_parameters([Parameter("speed_mps", value=2.0)])[0].successful


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"speed_mps": 9.0}, "speed_mps: .*expected a number such as 2.0 from 0 to 5"),
        ({"speed_mps": 2}, "speed_mps: .*expected a number such as 2.0"),
        ({"on": "yes"}, "on: .*expected true or false"),
        ({"size__width_m": -1.0}, r"VehicleDimensions.width_m is -1.0"),
    ],
)
def test_a_bad_value_is_refused_in_one_line(
    make_node: MakeNode, overrides: dict[str, object], words: str
) -> None:
    with pytest.raises(ConfigurationError, match=words) as caught:
        declare(make_node(**overrides), Example)
    assert "\n" not in str(caught.value)


def test_a_map_without_a_file_or_an_origin_is_refused_by_name() -> None:
    with pytest.raises(ConfigurationError, match="parameter map_file is not set"):
        MapParameters().load()
    with pytest.raises(ConfigurationError, match="parameter map_origin_longitude is not set"):
        MapParameters(map_file="x.osm", map_origin_latitude=49.0).load()


class Managed:
    """A managed node's parameters, and what became of them."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.state = "unconfigured"
        self.changes = 0
        self.declared = Declared(node, lambda: self.state, self._changed)
        self.declared.add(LifecycleParameters)
        self.declared.add(MapParameters)
        self.declared.add(DeciderConfig)
        self.declared.add(PolicyParameters)
        self.declared.guard()
        for config in (LifecycleParameters, MapParameters, DeciderConfig, PolicyParameters):
            self.declared.read(config)

    def _changed(self) -> None:
        self.changes += 1

    def set(self, name: str, value: object) -> str:
        """Set a parameter; why that was refused, or "ok"."""
        result = self.node.set_parameters([Parameter(name, value=value)])[0]
        return "ok" if result.successful else str(result.reason)


@pytest.fixture
def managed(make_node: MakeNode) -> Managed:
    return Managed(make_node())


def test_what_may_change_at_any_time_takes_effect_at_once(managed: Managed) -> None:
    managed.state = "active"
    assert managed.set("max_situation_age_s", 0.3) == "ok"
    assert managed.changes == 1
    assert managed.declared.read(DeciderConfig).max_situation_age_s == 0.3


def test_what_is_loaded_may_change_only_before_that_and_the_refusal_says_so(
    managed: Managed,
) -> None:
    managed.state = "active"
    refusal = managed.set("map_file", "other.osm")
    assert refusal == (
        "parameter map_file may change while the node is unconfigured, but it is active: "
        "deactivate it, clean it up, set the parameter and configure it again"
    )
    assert managed.node.get_parameter("map_file").value == ""
    managed.state = "unconfigured"
    assert managed.set("map_file", "other.osm") == "ok"
    assert managed.declared.read(MapParameters).map_file == "other.osm"


@pytest.mark.parametrize("name", ["autostart", "use_sim_time"])
def test_what_is_read_at_the_start_never_changes(managed: Managed, name: str) -> None:
    assert managed.set(name, False) == (
        f"parameter {name} is read once, when the node starts; start the node with another value"
    )


def test_a_change_that_makes_no_sense_is_refused_in_the_words_of_the_configuration(
    managed: Managed,
) -> None:
    managed.state = "active"
    refusal = managed.set("supervisor", "strict")
    assert refusal == "supervisor is 'strict', expected one of: off, report, enforce"
    assert "recovery_s" in managed.set("recovery_s", -1.0)
    assert managed.changes == 0


def test_every_parameter_says_when_it_may_change(managed: Managed) -> None:
    constraints = {
        name: managed.node.describe_parameter(name).additional_constraints
        for name in ("recovery_s", "map_file", "autostart")
    }
    assert constraints == {
        "recovery_s": "may change at any time",
        "map_file": "may change while the node is unconfigured",
        "autostart": "is read once, when the node starts",
    }


def assumptions(node: Node, rate_hz: float) -> SafetyAssumptions:
    declared = Declared(node, lambda: "unconfigured", lambda: None)
    add_assumptions(declared)
    return read_assumptions(declared, rate_hz)


def test_the_supervisor_assumes_what_its_parameters_say(make_node: MakeNode) -> None:
    node = make_node(
        safety__ego__braking_mps2=2.5,
        safety__traffic__acceleration_mps2=3.0,
        safety__vehicle__length_m=5.0,
        safety__speed_error_mps=0.5,
    )
    assert assumptions(node, rate_hz=4.0) == SafetyAssumptions(
        decision_period_s=0.25,
        speed_error_mps=0.5,
        ego=EgoLimits(braking_mps2=2.5),
        traffic=TrafficLimits(acceleration_mps2=3.0),
        vehicle=VehicleDimensions(length_m=5.0),
    )
    gap = node.describe_parameter("safety.safe_gap_s")
    assert gap.description.startswith("Least time between the ego's leaving")
    assert gap.floating_point_range[0].to_value == 30.0


@pytest.mark.parametrize("name", ["decision_period_s", "traffic.default_speed_limit_mps"])
def test_what_would_have_no_effect_is_no_parameter(make_node: MakeNode, name: str) -> None:
    node = make_node()
    assumptions(node, rate_hz=2.0)
    assert not node.has_parameter(f"safety.{name}")


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"safety__leader_braking_mps2": 3.0}, "leader_braking_mps2 is 3.0, expected at least"),
        ({"safety__safe_gap_s": -1.0}, "parameter safety.safe_gap_s: .* from 0 to 30"),
        ({"safety__ego__slow_mps": 6.0}, "EgoLimits.slow_mps is 6.0, expected less than"),
    ],
)
def test_assumptions_that_contradict_each_other_are_refused(
    make_node: MakeNode, overrides: dict[str, object], words: str
) -> None:
    with pytest.raises(ConfigurationError, match=words):
        assumptions(make_node(**overrides), rate_hz=2.0)


def test_an_unknown_supervisor_is_refused_with_those_there_are() -> None:
    with pytest.raises(ConfigurationError, match="'strict', expected one of: off, report, enforce"):
        PolicyParameters(supervisor="strict")


def flat(values: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    result: dict[str, Any] = {}
    for name, value in values.items():
        result |= (
            flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {prefix + name: value}
        )
    return result


def defaults(*configs: object) -> dict[str, Any]:
    result: dict[str, Any] = {}
    for config in configs:
        result |= flat(dataclasses.asdict(config))  # type: ignore[call-overload]
    return result


def test_the_parameter_file_holds_all_parameters_with_their_defaults() -> None:
    document = yaml.safe_load(PLANNER_YAML.read_text("utf-8"))
    found = {node: flat(entry["ros__parameters"]) for node, entry in document.items()}
    intersection = dataclasses.asdict(IntersectionConfig())
    del intersection["sensor_range_m"]  # the situation's own
    situation = defaults(
        LifecycleParameters(), MapParameters(), EgoParameters(), ObjectsAdapter(), AgeLimits(),
        SynchroniserConfig(), ClockParameters(), SituationConfig(),
    ) | flat(
        {
            "intersection": intersection,
            "plausibility": dataclasses.asdict(PlausibilityLimits()),
            "rates": dataclasses.asdict(InputRates()),
        }
    )  # fmt: skip
    safety = dataclasses.asdict(SafetyAssumptions())
    del safety["decision_period_s"]  # follows from rate_hz
    del safety["traffic"]["default_speed_limit_mps"], safety["vehicle"]["width_m"]  # without use
    policy = defaults(
        LifecycleParameters(), PolicyParameters(), DeciderConfig(), ClockParameters(),
        StandingClockParameters(),
    ) | flat({"safety": safety, "rates": dataclasses.asdict(SituationRates())})  # fmt: skip
    for argument in (
        "map_file", "map_origin_latitude", "map_origin_longitude", "map_projector", "memory",
        "sim_time_patience_s",
    ):  # fmt: skip
        del situation[argument]  # arguments of the launch file
    for argument in ("policy", "supervisor", "clock_timeout_s", "sim_time_patience_s"):
        del policy[argument]  # too
    assert found["/**/situation"] == pytest.approx(situation, abs=1e-4)
    assert found["/**/policy"] == pytest.approx(policy)


def keys_twice(node: yaml.Node) -> list[str]:
    if not isinstance(node, yaml.MappingNode):
        return []
    names = [key.value for key, _ in node.value]
    twice = [name for name in names if names.count(name) > 1]
    return twice + [name for _, value in node.value for name in keys_twice(value)]


def test_nothing_stands_twice_in_the_parameter_file() -> None:
    document = yaml.compose(PLANNER_YAML.read_text("utf-8"))
    assert keys_twice(document) == []
