# SPDX-License-Identifier: Apache-2.0
"""Parameters of nodes, declared from frozen dataclasses so that both always agree.

A field's metadata give `description`, `minimum`, `maximum`, and `live` where the parameter may
change at any time or `fixed` where it never may. Nested dataclasses become prefixes
("ego_dimensions.length_m").
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Any, NamedTuple, TypeVar, get_type_hints

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from risk_dqn_planner.errors import ConfigurationError

Config = TypeVar("Config")

_SCALARS = (bool, int, float, str)
_UNITS = {
    "_m": "m", "_mps": "m/s", "_mps2": "m/s^2", "_s": "s", "_rad": "rad", "_deg": "degrees",
    "_hz": "Hz", "_radps": "rad/s", "_m2": "m^2",
}  # fmt: skip
_LIVE = "may change at any time"
_RESTING = "may change while the node is unconfigured"
_FIXED = "is read once, when the node starts"


class _Leaf(NamedTuple):
    """A field that is a parameter."""

    name: str
    default: Any
    metadata: Mapping[str, Any]


def declare(
    node: Node,
    config_type: type[Config],
    prefix: str = "",
    given: Mapping[str, Any] | None = None,
) -> Config:
    """Declare a parameter for each field of a dataclass, fixed from now on, and return its values.

    given: values of fields that are no parameters of their own. Fields that are neither numbers,
    text nor dataclasses keep their defaults.

    Raises:
        ConfigurationError: a value has the wrong type, is out of range or contradicts another.
    """
    given = given or {}
    for leaf in _leaves(config_type, prefix, given):
        _declare_one(node, leaf, _FIXED, read_only=True)
    return _read(node, config_type, prefix, given, {})


class Declared:
    """The parameters of a managed node: declared once, and read whenever it is configured.

    What may change at any time takes effect at once; everything else is refused unless the node
    is unconfigured, when nothing has been read yet.
    """

    def __init__(self, node: Node, state: Callable[[], str], changed: Callable[[], None]) -> None:
        """Tell `state` of the node's lifecycle in refusals; call `changed` after live changes."""
        self._node = node
        self._state = state
        self._changed = changed
        self._when: dict[str, str] = {"use_sim_time": _FIXED}
        self._configured: dict[tuple[type[Any], str], Mapping[str, Any]] = {}

    def add(self, config_type: type[Any], prefix: str = "", skip: Iterable[str] = ()) -> None:
        """Declare a parameter for each field of a dataclass, but for those in `skip`.

        Raises:
            ConfigurationError: a value has the wrong type or is out of range.
        """
        for leaf in _leaves(config_type, prefix, dict.fromkeys(skip)):
            when = _LIVE if leaf.metadata.get("live") else _RESTING
            self._when[leaf.name] = _FIXED if leaf.metadata.get("fixed") else when
            _declare_one(self._node, leaf, self._when[leaf.name])

    def guard(self) -> None:
        """Look at every change from now on; what is declared later is not looked at."""
        self._node.add_on_set_parameters_callback(self._on_set)
        self._node.add_post_set_parameters_callback(self._after_set)

    def read(
        self, config_type: type[Config], prefix: str = "", given: Mapping[str, Any] | None = None
    ) -> Config:
        """Return the present values; `given` are those of fields that were skipped.

        Raises:
            ConfigurationError: they contradict each other.
        """
        self._configured[config_type, prefix] = given or {}
        return _read(self._node, config_type, prefix, given or {}, {})

    def _on_set(self, parameters: list[Parameter]) -> SetParametersResult:
        resting = self._state() == "unconfigured"
        for parameter in parameters:
            when = self._when.get(parameter.name, _LIVE)
            if when is _FIXED or (when is _RESTING and not resting):
                reason = self._refusal(parameter.name, when)
                return SetParametersResult(successful=False, reason=reason)
        changes = {parameter.name: parameter.value for parameter in parameters}
        if resting:
            return SetParametersResult(successful=True)  # `configure` looks at all together
        try:
            # A copy: `configure` may be reading in another thread.
            for (config_type, prefix), given in list(self._configured.items()):
                _read(self._node, config_type, prefix, given, changes)
        except ConfigurationError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _refusal(self, name: str, when: str) -> str:
        if when is _RESTING:
            return (
                f"parameter {name} {_RESTING}, but it is {self._state()}: deactivate it, clean it "
                "up, set the parameter and configure it again"
            )
        return f"parameter {name} {_FIXED}; start the node with another value"

    def _after_set(self, parameters: list[Parameter]) -> None:
        if any(self._when.get(parameter.name) is _LIVE for parameter in parameters):
            # Of an unconfigured node they may contradict each other, until it is configured; who
            # sets them would wait for ever for the answer that an error here cuts off.
            with suppress(ConfigurationError):
                self._changed()


def _leaves(config_type: type[Any], prefix: str, without: Mapping[str, Any]) -> list[_Leaf]:
    hints, defaults = get_type_hints(config_type), config_type()
    found: list[_Leaf] = []
    for item in dataclasses.fields(defaults):
        kind, name = hints[item.name], prefix + item.name
        if item.name in without:
            continue
        if isinstance(kind, type) and dataclasses.is_dataclass(kind):
            found += _leaves(kind, f"{name}.", {})
        elif kind in _SCALARS:
            found.append(_Leaf(name, kind(getattr(defaults, item.name)), item.metadata))
    return found


def _read(
    node: Node,
    config_type: type[Config],
    prefix: str,
    given: Mapping[str, Any],
    changes: Mapping[str, Any],
) -> Config:
    """Build a dataclass from parameters, of which some are about to change."""
    hints, values = get_type_hints(config_type), dict(given)
    for item in dataclasses.fields(config_type):  # type: ignore[arg-type]
        kind, name = hints[item.name], prefix + item.name
        if item.name in values:
            continue
        if isinstance(kind, type) and dataclasses.is_dataclass(kind):
            values[item.name] = _read(node, kind, f"{name}.", {}, changes)
        elif kind in _SCALARS:
            values[item.name] = changes.get(name, node.get_parameter(name).value)
    return config_type(**values)


def _declare_one(node: Node, leaf: _Leaf, when: str, *, read_only: bool = False) -> None:
    metadata, default = leaf.metadata, leaf.default
    descriptor = ParameterDescriptor(
        description=metadata.get("description", _described(leaf.name)),
        additional_constraints=when,
        read_only=read_only,
    )
    low, high = metadata.get("minimum"), metadata.get("maximum")
    if low is not None and high is not None:
        if isinstance(default, float):
            descriptor.floating_point_range = [
                FloatingPointRange(from_value=float(low), to_value=float(high), step=0.0)
            ]
        else:
            descriptor.integer_range = [
                IntegerRange(from_value=int(low), to_value=int(high), step=1)
            ]
    try:
        node.declare_parameter(leaf.name, default, descriptor)
    except ParameterException as error:
        expected = _expected(default, low, high)
        reason = " ".join(str(error).split())
        raise ConfigurationError(
            f"parameter {leaf.name}: {reason} (expected {expected})"
        ) from error


def _expected(default: object, low: float | None, high: float | None) -> str:
    names = {bool: "true or false", int: "an integer", float: "a number such as 2.0", str: "text"}
    bounds = "" if low is None or high is None else f" from {low:g} to {high:g}"
    return names[type(default)] + bounds


def _described(name: str) -> str:
    """Return a description from a name such as "ego_dimensions.length_m"."""
    words = name.replace(".", " ")
    for suffix, unit in _UNITS.items():
        if name.endswith(suffix):
            return f"{words.removesuffix(suffix).replace('_', ' ').capitalize()} [{unit}]"
    return words.replace("_", " ").capitalize()
